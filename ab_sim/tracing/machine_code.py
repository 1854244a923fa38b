"""Compile LLVM IR to machine code that can be called."""

import functools
import os
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import llvmlite.binding as llvm
from llvmlite.binding.newpassmanagers import NewPassManager

LIMIT = "AB_SIM_CPU_FEATURES"
"""Environment variable with processor features that no code may use, in LLVM's notation, such as
``-avx512f``. It is read whenever code is generated."""


class Optimization(NamedTuple):
    """Optimizations that LLVM applies to a module."""

    passes: tuple[str, ...]
    """llvmlite's names of the passes over the IR."""
    level: int
    """Optimization level of the code generator."""


AS_WRITTEN = Optimization((), 3)
"""Setting of LLVM for code as ``llvm_text`` emits it: no branches, nothing computed twice."""
_COMBINED = Optimization(("instruction_combine",), 3)
"""Setting for code without branches that also assembles vectors and takes them apart. All passes of
LLVM's level 3 take six times as long to run and do not make the code faster."""
CONTROL = Optimization(
    (
        *("sroa", "instruction_combine", "simplify_cfg", "always_inliner"),
        *("sroa", "new_gvn", "instruction_combine", "simplify_cfg"),
    ),
    1,
)
"""Setting for long code that branches. These passes make such code nearly as fast as LLVM's level 1
does, in less than a tenth of the compile time. Code generation at level 3 takes a sixth longer for
no gain."""

NOTHING: Mapping[str, int] = {}
"""Default of ``MachineCode``: no function is defined elsewhere."""


class MachineCode:
    """Functions of one LLVM module as machine code, freed together with this object.

    Parameters
    ----------
    text
        LLVM IR.
    features
        Processor features in LLVM's notation (``"+fma,+avx2"``); None for those of this processor,
        within the limit of the environment variable.
    optimization
        Optimizations to apply.
    elsewhere
        Addresses of functions that the text only declares, by their names.

    Raises
    ------
    RuntimeError
        The text is not valid LLVM IR; the message is LLVM's.
    """

    def __init__(
        self,
        text: str,
        features: str | None = None,
        optimization: Optimization = _COMBINED,
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
        """Return the address of a function.

        Raises
        ------
        KeyError
            There is no function of that name.
        """
        value: int = self._engine.get_function_address(name)
        if not value:
            raise KeyError(name)
        return value


def _processor_features() -> str:
    """Return the processor features that code may use, in LLVM's notation.

    The environment variable ``LIMIT`` is appended, which turns features off.
    """
    features, limit = str(llvm.get_host_cpu_features().flatten()), os.environ.get(LIMIT, "")
    return f"{features},{limit}" if limit else features


def _run(passes: Sequence[str], module: Any, machine: Any) -> None:
    """Apply LLVM's passes to a module, in place."""
    if not passes:
        return
    builder = llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options())
    manager = llvm.create_new_module_pass_manager()
    for name in passes:
        getattr(manager, f"add_{name}_pass")()
    manager.run(module, builder)
    # llvmlite 0.50 never frees a pass manager, which takes 0.15 MB once it has run: the _dispose
    # of the first of its two base classes does nothing.
    NewPassManager._dispose(manager)
    manager.detach()


def _linked(object_file: Any, elsewhere: Mapping[str, int]) -> Any:
    """Return an engine that holds machine code only.

    An engine that compiles a module itself would keep the module and the target machine in memory.
    """
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
    """Return LLVM's target for this machine; the first call initialises LLVM."""
    # Loop strength reduction, turned off for the whole process: it takes a fifth of the time of
    # compiling code with control flow, and does not make its loops faster.
    llvm.set_option("ab_sim", "-disable-lsr")
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    return llvm.Target.from_default_triple()


def _machine(features: str | None, level: int) -> Any:
    """Return the target machine, which generates code for a processor."""
    if features is None:
        return _machine_for(llvm.get_host_cpu_name(), _processor_features(), level)
    return _machine_for("", features, level)


@functools.cache
def _machine_for(cpu: str, features: str, level: int) -> Any:
    """Return a cached target machine.

    Threads may share it, as llvmlite holds a lock during each of its calls.
    """
    return _native().create_target_machine(
        cpu=cpu, features=features, opt=level, jit=True, codemodel="jitdefault"
    )
