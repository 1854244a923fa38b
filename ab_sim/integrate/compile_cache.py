"""Kernels, compiled once and kept on disk.

Numba's own cache looks at the file of the function that it caches and not at what that function
calls, has one index for all kernels of a function, which processes overwrite for one another, and
believes what it reads. Here each kernel has a file of its own, named by all that it follows from:
function, types, processor, and the sources that function and types are made of. What is read has to
prove that it was written for exactly that.
"""

import contextlib
import fcntl
import hashlib
import os
import pickle
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numba
from numba.core import types
from numba.core.caching import _Cache, _cache_log
from numba.core.compiler import CompileResult
from numba.core.compiler_lock import global_compiler_lock
from numba.core.serialize import dumps
from numba.core.sigutils import normalize_signature
from numba.core.types.containers import BaseTuple

from ab_sim.dynamics.system import System, ball_number
from ab_sim.integrate.cache_folder import cache_folder
from ab_sim.integrate.kept import KeptKind
from ab_sim.integrate.linked import linked_only
from ab_sim.integrate.sources import NotOfSources, sources, versions


def compiled(function: Callable[..., Any]) -> Any:
    """Compile a kernel: cached on disk, releasing Python's lock while it runs.

    A kernel that somebody else is compiling is waited for. It is compiled anew in every process if
    not all that it is made of can be found in files: where a class of its types is of a script, a
    notebook, or a function's own.

    Statements that do the same to neighbouring numbers, as two balls' equations do, become vector
    instructions (``SLP_VECTORIZE``), which numba leaves out unless told. It is worth a quarter of a
    step without events; kernels with events gain less, and would take half as long again to make.
    """
    kernel = numba.njit(nogil=True, error_model="numpy", _nrt=False)(function)
    codegen = kernel.targetctx.codegen()
    kernel._cache = cache = KernelFiles(function, codegen)
    compile_now = kernel.compile

    def compile_in_turn(signature: Any) -> Any:
        counted = _counts_its_balls(signature)
        with _vector_instructions(counted), linked_only(codegen), cache.turn(signature):
            return compile_now(signature)

    kernel.compile = compile_in_turn
    return kernel


class KernelFiles(_Cache):  # type: ignore[misc]
    """The kernels of one function on disk, a file for each signature.

    Args:
        function: what is compiled.
        codegen: what makes its machine code.
    """

    def __init__(self, function: Callable[..., Any], codegen: Any) -> None:
        self._function, self._codegen = function, codegen

    @property
    def cache_path(self) -> Path | None:
        """The folder; None where there is none."""
        return cache_folder()

    def load_overload(self, signature: Any, target_context: Any) -> Any:
        """The kernel of that signature; None if it is not there, or not as it was written."""
        content = self._read(signature)
        if content is None:
            return None
        target_context.refresh()
        found = CompileResult._rebuild(target_context, *pickle.loads(content))
        return found if found.signature.args == normalize_signature(signature)[0] else None

    def save_overload(self, signature: Any, kernel: Any) -> None:
        """Keep a kernel; a disk that is full costs the time to compile it again."""
        key, file = self._key_and_file(signature)
        if file is None or kernel.library.has_dynamic_globals:
            return
        content = dumps(kernel._reduce())
        with contextlib.suppress(OSError):
            descriptor, unfinished = tempfile.mkstemp(dir=file.parent)
            try:
                with open(descriptor, "wb") as writing:
                    writing.write(_seal(key, content) + content)
                os.replace(unfinished, file)
            except BaseException:
                os.unlink(unfinished)
                raise
            _cache_log("[cache] data saved to %r", file)

    def lacks(self, signature: Any) -> bool:
        """Whether the kernel of that signature could be kept on disk, and is not there."""
        _, file = self._key_and_file(signature)
        return file is not None and self._read(signature) is None

    @contextlib.contextmanager
    def turn(self, signature: Any) -> Iterator[None]:
        """Wait until nobody else is compiling the kernel, and keep others waiting meanwhile.

        Who has waited finds it on disk. The lock goes with the process, however that ends. It saves
        time only: files are right without it.
        """
        _, file = self._key_and_file(signature)
        with contextlib.ExitStack() as held:
            if file is not None and self._read(signature) is None:
                with contextlib.suppress(OSError):
                    lock = file.with_suffix(".lock")
                    fcntl.flock(held.enter_context(lock.open("w")), fcntl.LOCK_EX)
                    held.callback(lock.unlink, missing_ok=True)
            yield

    def flush(self) -> None:
        """Nothing is kept that could grow stale."""

    enable = disable = flush

    def _read(self, signature: Any) -> bytes | None:
        key, file = self._key_and_file(signature)
        if file is None:
            return None
        try:
            content = file.read_bytes()
        except OSError:
            return None
        _cache_log("[cache] data loaded from %r", file)
        seal = len(_seal(key, b""))
        return content[seal:] if content[:seal] == _seal(key, content[seal:]) else None

    def _key_and_file(self, signature: Any) -> tuple[str, Path | None]:
        """All that a kernel follows from, and the file named by it."""
        folder = cache_folder()
        try:
            key = repr(self._key(signature))
        except NotOfSources:
            return "", None
        if folder is None:
            return key, None
        name = hashlib.sha256(key.encode()).hexdigest()[:32]
        return key, folder / f"{self._function.__name__}-{name}.nbc"

    def _key(self, signature: Any) -> tuple[Any, ...]:
        arguments, result = normalize_signature(signature)
        things = [self._function, *_classes(arguments)]
        names = [_importable(thing) for thing in things]
        homes = [thing.__module__ for thing in things]
        digests = [(name, source.digest) for name, source in sources(homes).items()]
        target = self._codegen.magic_tuple()
        return names, arguments, result, target, digests, versions(homes)


_NAMED_ALIKE = (
    types.Number,
    types.Boolean,
    types.Array,
    type(types.none),
    type(types.unicode_type),
)
"""Kinds of numba's types whose names are the same in every process, and say all."""


def _seal(key: str, content: bytes) -> bytes:
    """What only this content has if it is to be found under this key."""
    return hashlib.sha256(hashlib.sha256(key.encode()).digest() + content).digest()


def _classes(kinds: tuple[Any, ...]) -> list[type[Any]]:
    """The classes of named tuples in numba's types: their methods are in the kernel."""
    found: list[type[Any]] = []
    for kind in kinds:
        if isinstance(kind, KeptKind):
            found += _classes((kind.content,))
        elif isinstance(kind, BaseTuple):
            named = getattr(kind, "instance_class", None)
            found += ([] if named is None else [named]) + _classes(tuple(kind.types))
        elif not isinstance(kind, _NAMED_ALIKE):
            raise NotOfSources(f"{kind} may be called otherwise in another process")
    return found


def _importable(thing: Any) -> str:
    """The name under which another process finds a function or a class."""
    name = f"{thing.__module__}.{thing.__qualname__}"
    if "<" in name:
        raise NotOfSources(f"{name} is made while the process runs")
    return name


def _counts_its_balls(signature: Any) -> bool:
    """Whether a System among the arguments says by its type how many balls it has."""
    arguments, _ = normalize_signature(signature)
    kept = [part for kind in arguments if isinstance(kind, KeptKind) for part in kind.content.types]
    systems = [k for k in (*arguments, *kept) if getattr(k, "instance_class", None) is System]
    return any(ball_number(kind) is not None for kind in systems)


@contextlib.contextmanager
def _vector_instructions(wanted: bool) -> Iterator[None]:
    """The setting is numba's, for the whole process: give it back at once, others compile too.

    Under the lock that numba compiles under: of two threads, each would else see the other's.
    """
    with global_compiler_lock:
        before = numba.config.SLP_VECTORIZE
        numba.config.SLP_VECTORIZE = int(wanted)
        try:
            yield
        finally:
            numba.config.SLP_VECTORIZE = before
