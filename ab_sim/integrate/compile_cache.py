"""Numba's disk cache, keyed so that a stale kernel is impossible.

Numba looks at the file of the function that it caches, not at what that function calls: an
edited effect would silently go on with the old machine code. So the cache folder is named by a
hash of all of the package's sources and of the versions that compile them.
"""

import contextlib
import hashlib
import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import llvmlite
import numba
import numpy as np
from numba.core.compiler_lock import global_compiler_lock

from ab_sim.dynamics.system import System, ball_number


def cache_folder() -> Path:
    """Where compiled kernels of exactly these sources are kept; made if need be."""
    package = Path(__file__).resolve().parents[1]
    key = hashlib.sha256(repr((sys.version, numba.__version__, np.__version__)).encode())
    key.update(llvmlite.__version__.encode())
    for source in sorted(package.rglob("*.py")):
        key.update(str(source.relative_to(package)).encode() + b"\0" + source.read_bytes())
    home = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    for base in (Path(home), Path(tempfile.gettempdir(), f"cache-{os.getuid()}")):
        folder = base / "ab_sim" / key.hexdigest()[:16]
        try:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        except OSError:
            continue
        # Numba runs what it finds there, so it has to be our own.
        if os.access(folder, os.W_OK) and folder.stat().st_uid == os.getuid():
            return folder
    return Path(tempfile.mkdtemp(prefix="ab_sim-kernels-"))


def compiled(function: Callable[..., Any]) -> Any:
    """Compile a kernel: cached on disk, releasing Python's lock while it runs.

    Statements that do the same to neighbouring numbers, as two balls' equations do, become vector
    instructions (``SLP_VECTORIZE``), which numba leaves out unless told. It is worth a quarter of a
    step without events; kernels with events gain less, and would take half as long again to make.
    """
    with _numba_settings(CACHE_DIR=str(cache_folder())):
        kernel = numba.njit(cache=True, nogil=True, error_model="numpy", _nrt=False)(function)
    compile_now = kernel.compile

    def compile_as_fits(signature: Any) -> Any:
        with _numba_settings(SLP_VECTORIZE=int(_counts_its_balls(signature))):
            return compile_now(signature)

    kernel.compile = compile_as_fits
    return kernel


def _counts_its_balls(signature: Any) -> bool:
    """Whether a System among the arguments says by its type how many balls it has."""
    arguments = signature if isinstance(signature, tuple) else signature.args
    systems = [kind for kind in arguments if getattr(kind, "instance_class", None) is System]
    return any(ball_number(kind) is not None for kind in systems)


@contextlib.contextmanager
def _numba_settings(**settings: Any) -> Iterator[None]:
    """Settings are numba's, for the whole process: give them back at once, others compile too.

    Under the lock that numba compiles under: of two threads, each would else see the other's.
    """
    with global_compiler_lock:
        before = {name: getattr(numba.config, name) for name in settings}
        for name, value in settings.items():
            setattr(numba.config, name, value)
        try:
            yield
        finally:
            for name, value in before.items():
                setattr(numba.config, name, value)
