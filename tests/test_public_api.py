"""Public API: names, import time, types, examples, and display of results."""

import ast
import builtins
import doctest
import importlib
import inspect
import os
import pkgutil
import re
import subprocess
import sys
import typing
from collections.abc import Iterator
from pathlib import Path
from types import FunctionType, SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure

import ab_sim
from ab_sim.base.presentation import Presented
from ab_sim.scene.registry import effect_classes
from tests.waiting import PATIENCE

NAMES = [name for name in ab_sim.__all__ if name not in ("__version__", "results")]
TYPES = list(ab_sim.results.__all__)
SLOW = {
    *("numpy", "pydantic", "llvmlite", "scipy", "matplotlib", "rerun", "pyarrow", "yaml", "pint"),
}


@pytest.fixture(autouse=True)
def registries() -> Iterator[None]:
    """Restore the registries after each test, so that examples do not affect other tests."""
    with ab_sim.temporary_registrations():
        yield


def public(name: str) -> object:
    return getattr(ab_sim if name in NAMES else ab_sim.results, name)


def in_a_process(program: str) -> str:
    """Return the output of a program in a new process."""
    environment = {**os.environ, "PYTHONPATH": str(Path(ab_sim.__file__).parents[1])}
    return subprocess.run(
        [sys.executable, "-c", program],
        env=environment, check=True, capture_output=True, text=True, timeout=PATIENCE,
    ).stdout  # fmt: skip


def test_importing_it_imports_nothing_that_takes_long() -> None:
    """Check the imported modules instead of the time (3 ms), which varies on a busy machine."""
    loaded = in_a_process("import sys; import ab_sim; print(*sys.modules)").split()
    assert len(loaded) < 120
    assert not SLOW & {name.partition(".")[0] for name in loaded}
    own = {name for name in loaded if name.startswith("ab_sim.")}
    assert own == {"ab_sim.base", "ab_sim.base.version"}


def test_names_stay_what_they_are_after_all_modules_are_imported() -> None:
    program = """
import importlib, pkgutil
import ab_sim, ab_sim.drive.accuracy
kinds = {name: type(getattr(ab_sim, name)) for name in ab_sim.__all__}
held = {name: getattr(ab_sim, name) for name in ab_sim.__all__}
for found in pkgutil.walk_packages(ab_sim.__path__, "ab_sim."):
    if not found.name.startswith(("ab_sim.nodes", "ab_sim.__main__")):
        importlib.import_module(found.name)
print([name for name in ab_sim.__all__ if getattr(ab_sim, name) is not held[name]])
import types
modules = [name for name, kind in kinds.items() if kind is types.ModuleType]
print(modules, ab_sim.drive.accuracy.resolve_accuracy.__module__)
"""
    assert in_a_process(program).split("\n")[:2] == [
        "[]", "['results'] ab_sim.drive.accuracy.search"
    ]  # fmt: skip


def test_no_name_is_that_of_a_module() -> None:
    beside = {found.name for found in pkgutil.iter_modules(ab_sim.__path__)}
    assert beside & set(ab_sim.__all__) == {"results"}


def test_type_checkers_see_the_same_names() -> None:
    (block,) = [
        node
        for node in ast.parse(Path(ab_sim.__file__).read_text(encoding="utf-8")).body
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
    ]
    seen = {
        alias.name: node.module
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert seen.keys() | {"__version__"} == set(ab_sim.__all__)
    for name, module in seen.items():
        assert getattr(importlib.import_module(str(module)), name) is getattr(ab_sim, name)
    assert sorted(ab_sim.__all__) == ab_sim.__all__
    assert set(ab_sim.__all__) <= set(dir(ab_sim))


def test_a_name_that_is_not_there_names_the_close_ones() -> None:
    with pytest.raises(AttributeError, match="'equilibrium'.* mean equilibria"):
        ab_sim.equilibrium  # type: ignore[attr-defined]  # noqa: B018
    with pytest.raises(AttributeError, match="no attribute 'qqqqq'"):
        ab_sim.qqqqq  # type: ignore[attr-defined]  # noqa: B018
    with pytest.raises(ImportError):
        from ab_sim import simulat  # type: ignore[attr-defined]  # noqa: F401


def functions(name: str) -> Iterator[tuple[str, FunctionType]]:
    """Return a public function, or a class's public methods, properties and constructor."""
    found = public(name)
    if isinstance(found, FunctionType):
        yield name, found
        return
    for base in inspect.getmro(typing.cast(type, found)):
        if not base.__module__.startswith("ab_sim"):
            continue
        for key, value in vars(base).items():
            if key.startswith("_") and key != "__init__":
                continue
            value = value.fget if isinstance(value, property) else value
            value = getattr(value, "func", None) or getattr(value, "__func__", None) or value
            if isinstance(value, FunctionType):
                yield f"{base.__name__}.{key}", value


def test_no_public_signature_is_untyped() -> None:
    """Check that parameters and results have types, without ``Any`` at any depth."""
    open_ends, seen = [], 0
    for name in NAMES + TYPES:
        for where, function in functions(name):
            types = hints_of(function)
            given = [key for key in inspect.signature(function).parameters if key != "self"]
            given = [key for key in given if key not in ("cls", "_")]
            seen += 1
            open_ends += [f"{where}: {key} has no type" for key in given if key not in types]
            open_ends += [f"{where}: {key}: Any" for key, hint in types.items() if vague(hint)]
            if "return" not in types:
                open_ends.append(f"{where}: what it returns has no type")
    assert open_ends == [] and seen > 100


def hints_of(function: FunctionType) -> dict[str, object]:
    names = {"Figure": Figure, "DataFrame": SimpleNamespace, "Comparison": object}
    names["Dataset"] = SimpleNamespace
    return typing.get_type_hints(function, {**names, **function.__globals__})


def vague(hint: object) -> bool:
    """Return whether a type is or contains Any; a type variable counts as its bound."""
    if hint is typing.Any:
        return True
    if isinstance(hint, typing.TypeVar):
        return vague(hint.__bound__)
    parts = typing.get_args(hint)
    if typing.get_origin(hint) is np.dtype:  # numpy's own annotation of ArrayLike
        return False
    if typing.get_origin(hint) is np.ndarray:  # the type of its shape is always Any
        parts = parts[1:]
    return any(vague(x) for part in parts for x in (part if isinstance(part, list) else [part]))


@pytest.mark.parametrize("name", NAMES)
def test_examples_are_right(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    documented(public(name), name)


def test_the_example_of_the_package_is_right() -> None:
    documented(ab_sim, "ab_sim", deep=False)


def documented(found: object, name: str, deep: bool = True) -> None:
    finder = doctest.DocTestFinder(recurse=deep and isinstance(found, type))
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    runner, examples, said = doctest.DocTestRunner(optionflags=flags), 0, list[str]()
    for test in finder.find(found, name, globs={}):
        examples += len(test.examples)
        runner.run(test, out=said.append)
    assert not said, "".join(said)
    assert examples, f"{name} has no example"


@pytest.mark.parametrize("name", [name for name in NAMES if isinstance(public(name), FunctionType)])
def test_docstrings_say_what_is_taken_given_and_raised(name: str) -> None:
    function = public(name)
    text = inspect.getdoc(function) or ""
    assert "\nReturns\n---" in text or "-> None" in str(inspect.signature(function))
    assert "\nExamples\n---" in text
    given = inspect.signature(typing.cast(FunctionType, function)).parameters
    assert not given or "\nParameters\n---" in text
    described = text.partition("Parameters\n")[2].partition("\nReturns\n")[0]
    named = {key for line in described.splitlines() for key in line.partition(" :")[0].split(", ")}
    assert {*given} <= named


@pytest.mark.parametrize("name", TYPES)
def test_types_of_results_say_what_they_are(name: str) -> None:
    assert inspect.getdoc(public(name))


@pytest.fixture(scope="module")
def shown() -> dict[str, Presented]:
    """Compute one result of each kind that takes little time."""
    scene = ab_sim.load_scene("nsc-case-1")
    short = ab_sim.load_scene("thesis-hold", ["duration=0.1", "name=a <b> & $c$"])
    run = ab_sim.simulate(short)
    drag = "effects.viscous_drag.coefficient"
    return {
        "trajectory": run.trajectory,
        "run": run,
        "batch": ab_sim.simulate_batch(short, [{}, {"balls.mass": 0.002}], every=5),
        "equilibria": ab_sim.equilibria("thesis-hold", 300.0),
        "branches": ab_sim.branches("thesis-hold", speeds=[90.0, 100.0, 110.0, 120.0]),
        "map": ab_sim.stability_map(scene, ("speed", 50.0, 300.0, 4), (drag, 0.1, 0.5, 3)),
        "basin": ab_sim.basin(short, 3),
        "floquet": ab_sim.floquet("nsc-case-1", 300.0, start="balanced"),
        "followed": ab_sim.follow_floquet("nsc-case-1", "speed", [300.0, 310.0]),
        "modes": ab_sim.modes("couple-unbalance", 500.0),
        "recovery": ab_sim.recovery(scene, [0.2, 0.4]),
        "effect cost": ab_sim.effect_cost(short, repeats=1),
        "spread": ab_sim.robust(
            short, {"balls.mass": "5%", "start.speed": "uniform:0,9"}, runs=40, against=short
        ),
        "accuracy cost": ab_sim.accuracy_cost(
            ab_sim.load_scene("nsc-case-1", ["duration=0.1"]), 1, steps=[1e-3], tolerances=[1e-8]
        ),
    }


KINDS = [
    "trajectory", "run", "batch", "equilibria", "branches", "map", "basin", "floquet", "followed",
    "modes", "recovery", "effect cost", "accuracy cost", "spread",
]  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
def test_results_print_in_a_line_and_a_small_table(kind: str, shown: dict[str, Presented]) -> None:
    result = shown[kind]
    text, page = repr(result), result._repr_html_()
    assert text.startswith(f"<{type(result).__name__}: ") and len(text) < 300 and "\n" not in text
    assert page.count("<table>") == page.count("</table>") > 0 and len(page) < 10_000
    assert "<b> &" not in page.replace(f"<b>{type(result).__name__}</b>", "")


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("kind", KINDS)
def test_results_are_drawn(kind: str, shown: dict[str, Presented], tmp_path: Path) -> None:
    figure = shown[kind].plot()
    assert figure.axes and sum(len(axes.get_children()) for axes in figure.axes) > 10
    figure.savefig(tmp_path / "seen.png")
    assert (tmp_path / "seen.png").stat().st_size > 5000


def test_a_notebook_shows_figures_without_being_told_how(shown: dict[str, Presented]) -> None:
    assert shown["trajectory"].plot()._repr_png_().startswith(b"\x89PNG")  # type: ignore[attr-defined]


@pytest.mark.parametrize("kind", KINDS)
def test_results_become_data_frames(
    kind: str, shown: dict[str, Presented], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Use a substitute for pandas, which need not be installed."""

    class DataFrame(dict):
        def __init__(self, columns: dict[str, object]) -> None:
            super().__init__(columns)
            self.attrs: dict[str, object] = {}

    monkeypatch.setitem(sys.modules, "pandas", SimpleNamespace(DataFrame=DataFrame))
    frame = shown[kind].to_dataframe()
    lengths = {len(values) for values in frame.values()}
    assert len(lengths) == 1 and lengths.pop() > 0
    assert frame.attrs["units"].keys() == frame.keys()
    units = {*frame.attrs["units"].values()} - {None}
    assert units and all(isinstance(unit, str) for unit in units)


def test_pandas_takes_every_table(shown: dict[str, Presented]) -> None:
    pandas = pytest.importorskip("pandas")
    for result in shown.values():
        frame = result.to_dataframe()
        assert isinstance(frame, pandas.DataFrame) and len(frame) > 0


def test_without_pandas_it_says_how_to_get_it(
    shown: dict[str, Presented], monkeypatch: pytest.MonkeyPatch
) -> None:
    def importing(name: str, *args: object) -> object:
        if name == "pandas":
            raise ImportError("no pandas here")
        return there(name, *args)  # type: ignore[arg-type]

    there = builtins.__import__
    monkeypatch.delitem(sys.modules, "pandas", raising=False)
    monkeypatch.setattr(builtins, "__import__", importing)
    with pytest.raises(ImportError, match=f"{re.escape(sys.executable)} -m pip install pandas"):
        shown["trajectory"].to_dataframe()


def test_an_effect_may_be_registered_after_scenes_were_checked() -> None:
    ab_sim.load_scene("thesis-hold")

    @ab_sim.register_effect("pull", equation="f = -c", source="this test")
    class Pull(typing.NamedTuple):
        force: float

        def deck_force(self, deck: object) -> tuple[float, float]:
            return -self.force, 0.0

    scene = ab_sim.load_scene("thesis-hold", ["effects.pull.force=0.1", "duration=0.01"])
    assert ab_sim.simulate(scene).trajectory["x"][-1] < 0.0
    with pytest.raises(ValueError, match="registered twice"):
        ab_sim.register_effect("pull", equation="", source="")(Pull)


def test_temporary_registrations_are_forgotten() -> None:
    """A notebook's cell can run again, also after an error."""

    class Pull(typing.NamedTuple):
        force: float = 0.0

    for _ in range(2):
        with pytest.raises(ZeroDivisionError), ab_sim.temporary_registrations():
            ab_sim.register_effect("pull", equation="f = -c", source="this test")(Pull)
            ab_sim.register_metric("pull", meaning="none")(SimpleNamespace)  # type: ignore[type-var]
            ab_sim.register_stepper("pull", 1, "Euler", rows=[], weights=[1.0])
            assert "pull" in effect_classes()
            1 / 0  # noqa: B018
    assert "suspension" in effect_classes() and "pull" not in effect_classes()


def test_an_effect_whose_method_is_misspelt_is_refused() -> None:
    """Otherwise the method would never be called, and the effect would have no effect."""

    class Push(typing.NamedTuple):
        force: float

        def deck_froce(self, deck: object) -> tuple[float, float]:
            return self.force, 0.0

    with pytest.raises(ValueError, match="'deck_froce' .* mean 'deck_f"):
        ab_sim.register_effect("push", equation="", source="")(Push)
    assert "push" not in effect_classes()

    class Bare:
        force: float = 1.0

    with pytest.raises(ValueError, match="'push': .* Bare .* NamedTuple"):
        ab_sim.register_effect("push", equation="", source="")(Bare)  # type: ignore[type-var]


def test_calls_take_names_files_and_scenes_alike(tmp_path: Path) -> None:
    scene = ab_sim.load_scene("nsc-case-1")
    file = tmp_path / "mine.yaml"
    file.write_text(
        (Path(ab_sim.__file__).parents[1] / "config/scenes/nsc-case-1.yaml").read_text()
    )
    one, other, third = (
        [state.W for state in ab_sim.equilibria(each, 300.0).branches]
        for each in (scene, "nsc-case-1", file)
    )
    assert one == other == third
    with pytest.raises(ab_sim.InputError, match="speed = inf"):
        ab_sim.modes(scene, float("inf"))
    with pytest.raises(ab_sim.InputError, match="both axes"):
        ab_sim.stability_map(scene, ("speed", 1.0, 2.0), ("speed", 1.0, 2.0))
