"""From the text of LLVM's language to machine code that can be called."""

import functools
import os
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import llvmlite.binding as llvm
from llvmlite.binding.newpassmanagers import NewPassManager

LIMIT = "AB_SIM_CPU_FEATURES"
"""Environment variable: what of the processor all code is to do without, in LLVM's words, as in
``-avx512f``; read whenever code is made."""


class Optimization(NamedTuple):
    """How far LLVM is to go with a text."""

    passes: tuple[str, ...]
    """llvmlite's names of passes over the text."""
    level: int
    """Of the generation of machine code."""


AS_WRITTEN = Optimization((), 3)
"""For code without branches that says nothing twice, as ``llvm_text`` writes it."""
COMBINED = Optimization(("instruction_combine",), 3)
"""For such code that puts vectors together and takes them apart. All passes of LLVM's own level 3
take six times as long, and make it no faster."""
CONTROL = Optimization(
    (
        *("sroa", "instruction_combine", "simplify_cfg", "always_inliner"),
        *("sroa", "new_gvn", "instruction_combine", "simplify_cfg"),
    ),
    1,
)
"""For long code that branches. The passes make control nearly as fast as LLVM's own level 1 does,
in a tenth of the time: 0.03 in place of 0.48 s for that of collocation, whose runs take 2 % to 4 %
longer. Machine code of level 3 takes a sixth longer to make for no gain."""

NOTHING: Mapping[str, int] = {}


class MachineCode:
    """Functions of one text as machine code, kept as long as this object is.

    Args:
        text: in LLVM's language.
        features: of the processor, in LLVM's words (``"+fma,+avx2"``); those that it has if None.
        optimization: how far LLVM is to go.
        elsewhere: addresses of functions that the text only declares, by their names.

    Raises:
        RuntimeError: the text is not in that language; the message is LLVM's.
    """

    def __init__(
        self,
        text: str,
        features: str | None = None,
        optimization: Optimization = COMBINED,
        elsewhere: Mapping[str, int] = NOTHING,
    ) -> None:
        machine = _machine(features, optimization.level)
        module = llvm.parse_assembly(text)
        module.triple, module.data_layout = machine.triple, str(machine.target_data)
        _run(optimization.passes, module, machine)
        wanted = [f.name for f in module.functions if f.is_declaration and f.name in elsewhere]
        object_file = llvm.ObjectFileRef.from_data(machine.emit_object(module))
        self._engine = _linked(object_file, {name: elsewhere[name] for name in wanted})

    def address(self, name: str) -> int:
        """Of a function.

        Raises:
            KeyError: there is none of that name.
        """
        found: int = self._engine.get_function_address(name)
        if not found:
            raise KeyError(name)
        return found


def processor_features() -> str:
    """What code may use of the processor, in LLVM's words: what it has, within the limit set."""
    own, limit = str(llvm.get_host_cpu_features().flatten()), os.environ.get(LIMIT, "")
    return f"{own},{limit}" if limit else own


def _run(passes: Sequence[str], module: Any, machine: Any) -> None:
    if not passes:
        return
    builder = llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options())
    manager = llvm.create_new_module_pass_manager()
    for name in passes:
        getattr(manager, f"add_{name}_pass")()
    manager.run(module, builder)
    # llvmlite 0.50 never disposes of a pass manager, which has 0.15 MB once it has run: of the two
    # classes that it inherits from, the first one's _dispose does nothing.
    NewPassManager._dispose(manager)
    manager.detach()


def _linked(object_file: Any, elsewhere: Mapping[str, int]) -> Any:
    """An engine with machine code only: one that makes it keeps module and target machine, too."""
    declared = "\n".join(f'declare void @"{name}"()' for name in elsewhere)
    module = llvm.parse_assembly(declared)
    # The engine owns the machine from here on.
    engine = llvm.create_mcjit_compiler(module, _native().create_target_machine(jit=True))
    for name, address in elsewhere.items():
        engine.add_global_mapping(module.get_function(name), address)
    engine.remove_module(module)
    engine.add_object_file(object_file)
    engine.finalize_object()
    return engine


@functools.cache
def _native() -> Any:
    # Of all that LLVM makes in this process: it takes a fifth of the time that control takes to be
    # made, whose loops are no faster for it.
    llvm.set_option("ab_sim", "-disable-lsr")
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    return llvm.Target.from_default_triple()


def _machine(features: str | None, level: int) -> Any:
    """What writes code for a processor."""
    if features is None:
        return _machine_for(llvm.get_host_cpu_name(), processor_features(), level)
    return _machine_for("", features, level)


@functools.cache
def _machine_for(cpu: str, features: str, level: int) -> Any:
    """Made once, and used by one thread after the other: llvmlite locks each of its calls."""
    return _native().create_target_machine(
        cpu=cpu, features=features, opt=level, jit=True, codemodel="jitdefault"
    )
