"""The kernel cache: what processes find there is what they asked for, whoever wrote it, and when.

What the tests with a toy kernel say a process compiled, it counted itself.
"""

import os
import shutil
import stat
import subprocess
import sys
import tempfile
from pathlib import Path

import numba
import pytest

import ab_sim
from ab_sim.cache_folder import cache_folder
from ab_sim.integrate.compile_cache import compiled
from ab_sim.sources import sources, versions
from tests.integrate.cache_process import (
    FACTOR,
    LOOKS,
    RELOADS,
    WAITS,
    WRITES,
    Process,
    results,
    write_toy,
)


def test_folder_follows_the_environment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    folder = tmp_path / "ab_sim" / "kernels"
    assert cache_folder() == folder == cache_folder()
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700


def test_unwritable_home_is_no_obstacle(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    in_the_way = tmp_path / "file"
    in_the_way.write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(in_the_way))
    folder = cache_folder()
    assert folder is not None and folder.is_dir()


@pytest.fixture
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder for temporary files of this test's own, which is sticky."""
    folder = tmp_path / "elsewhere"
    folder.mkdir()
    folder.chmod(0o1777)
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


@pytest.mark.parametrize("linked", [False, True])
def test_no_folder_where_another_user_can_write(
    tmp_path: Path, elsewhere: Path, linked: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Wherever above it; also where a link leads there."""
    shared = tmp_path / "shared"
    home = shared / "home"
    home.mkdir(parents=True)
    if linked:
        (tmp_path / "link").symlink_to(home)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "link" if linked else home))
    assert cache_folder() == home / "ab_sim" / "kernels"
    shared.chmod(0o777)
    assert cache_folder() == elsewhere / f"cache-{os.getuid()}" / "ab_sim" / "kernels"
    shared.chmod(0o1777)
    assert cache_folder() == home / "ab_sim" / "kernels", "what is sticky only its owner moves"
    (home / "ab_sim" / "kernels").chmod(0o777)
    assert cache_folder() != home / "ab_sim" / "kernels"
    elsewhere.chmod(0o777)
    assert cache_folder() is None


def test_a_kernel_is_made_of_what_its_imports_lead_to() -> None:
    fixed = {"ab_sim.integrate.fixed_step", "ab_sim.spindle.segments"}
    planar, spans = "ab_sim.dynamics.carriers.planar", "ab_sim.integrate.steppers.collocation"
    kernel = fixed | {planar, spans}
    made_of = set(sources(kernel))
    assert made_of > kernel | {
        "ab_sim.integrate.response_tables",
        "ab_sim.dynamics.race.settle",
        "ab_sim.dynamics.slope",
        "ab_sim.integrate.events",
    }
    assert not {planar, spans} & set(sources(fixed)), "of carriers and steppers only its own"
    rooms = {name.split(".")[1] for name in made_of}
    assert rooms == {"dynamics", "integrate", "spindle", "errors"}, "no plots, nodes or scenes"
    assert not any(name.startswith("ab_sim.equations.effects") for name in made_of)
    drag = "ab_sim.equations.effects.viscous_drag"
    assert set(sources({*kernel, drag})) > {drag, "ab_sim.equations.motion"}
    assert {"python", "numba", "llvmlite", "numpy"} <= set(versions(kernel))


def test_an_edited_constant_never_meets_a_stale_kernel(tmp_path: Path) -> None:
    """A copy of the package, run, edited in an effect, run again with the same cache."""
    package = tmp_path / "ab_sim"
    shutil.copytree(Path(ab_sim.__file__).parent, package)
    shutil.copytree(Path(ab_sim.__file__).parents[1] / "config", tmp_path / "config")
    program = (
        "from ab_sim.drive import Drive; from ab_sim.scene import load_scene; "
        "d = Drive(load_scene('thesis-baseline', ['effects.rolling_friction='])); "
        "d.advance(2500); print(d.observe().theta[0]); "
        "from ab_sim.integrate.fixed_step import advance; "
        "print(sum(advance.stats.cache_misses.values()))"
    )

    def run() -> tuple[float, int]:
        done = subprocess.run(
            [sys.executable, "-c", program],
            capture_output=True,
            text=True,
            check=True,
            cwd=tmp_path,
            env={
                "XDG_CACHE_HOME": str(tmp_path / "cache"),
                "PATH": "",
                "PYTHONPATH": str(tmp_path),
            },
        )
        angle, compiled = done.stdout.split()
        return float(angle), int(compiled)

    first, compiled = run()
    assert compiled > 0
    plots = package / "figures" / "run.py"
    plots.write_text(plots.read_text() + "EDITED = True\n")
    assert run() == (first, 0)
    effect = package / "dynamics" / "effects" / "ball_spin.py"
    text = effect.read_text()
    assert "return 0.4 * ball.mass  # I / a^2" in text
    effect.write_text(text.replace("return 0.4 * ball.mass  #", "return 0.5 * ball.mass  #"))
    changed, compiled = run()
    assert changed != first and compiled > 0


@pytest.fixture
def toy(tmp_path: Path) -> Path:
    """A folder with a toy kernel, see cache_process."""
    write_toy(tmp_path)
    return tmp_path


@numba.njit(no_cpython_wrapper=True, no_cfunc_wrapper=True)
def doubled(x):  # type: ignore[no-untyped-def]
    return x + x


def test_only_what_python_calls_becomes_machine_code() -> None:
    """Also where one kernel calls another, which Python calls, too."""

    @compiled
    def inner(x):  # type: ignore[no-untyped-def]
        return doubled(x) + 1.0

    @compiled
    def outer(x):  # type: ignore[no-untyped-def]
        return inner(x) + doubled(x)

    assert outer(2.0) == 9.0 and inner(2.0) == 5.0
    found = [kernel.overloads[kernel.signatures[0]] for kernel in (doubled, inner, outer)]
    at = [one.library.get_pointer_to_function(one.fndesc.llvm_func_name) for one in found]
    assert [address != 0 for address in at] == [False, True, True]
    assert "_library_class" not in vars(inner.targetctx.codegen()), "what was found is left"


def test_two_processes_that_first_compile_two_laws_do_not_mix_them_up(toy: Path) -> None:
    """Both have looked before either writes; what the first one is to write last, it does."""
    one = Process(toy, "Twice", held=(WRITES,))
    other = Process(toy, "Squared", held=(WRITES,))
    assert one.says() == WRITES and other.says() == WRITES
    one.go()
    one.says()
    assert other.finish() == "75.0 compiled 1"
    one.finish()
    assert results(toy, "Twice", "Squared") == "30.0 75.0 compiled 0"


def test_of_two_processes_that_want_one_kernel_one_compiles_it(toy: Path) -> None:
    one, other = Process(toy, "Twice", held=(WRITES,)), Process(toy, "Twice", held=(WAITS,))
    assert one.says() == WRITES, "it has the lock, and holds it while it waits here"
    assert other.says() == WAITS
    other.go()
    assert one.finish() == "30.0 compiled 1"
    assert other.finish() == "30.0 compiled 0"


def test_who_is_killed_while_compiling_leaves_no_lock(toy: Path) -> None:
    one, other = Process(toy, "Twice", held=(WRITES,)), Process(toy, "Twice", held=(WAITS,))
    assert one.says() == WRITES
    assert other.says() == WAITS
    other.go()
    one.process.kill()
    one.process.communicate()
    assert other.finish() == "30.0 compiled 1"
    assert results(toy, "Twice") == "30.0 compiled 0"


def test_swapped_and_damaged_files_are_noticed(toy: Path) -> None:
    laws = ("Twice", "Squared", "Cubed", "Halved")
    right = "30.0 75.0 375.0 7.5 compiled"
    assert results(toy, *laws) == f"{right} 4"
    one, other, cut, bit = sorted(toy.joinpath("cache").rglob("*.nbc"))
    between = toy / "between"
    for source, target in ((one, between), (other, one), (between, other)):
        source.rename(target)
    cut.write_bytes(cut.read_bytes()[:-1000])
    content = bytearray(bit.read_bytes())
    content[len(content) // 2] ^= 1
    bit.write_bytes(content)
    assert results(toy, *laws) == f"{right} 4"
    assert results(toy, *laws) == f"{right} 0", "and mended"


def test_an_edit_of_what_an_effect_imports_is_noticed(toy: Path) -> None:
    """Also outside the package; what the kernel is not made of is of no account."""
    assert results(toy, "Twice") == "30.0 compiled 1"
    (toy / "beside.py").write_text("nothing = 0\n")
    assert results(toy, "Twice") == "30.0 compiled 0"
    (toy / "factor.py").write_text("FACTOR = 3.0\n")
    assert results(toy, "Twice") == "45.0 compiled 1"


def test_what_was_edited_after_it_was_imported_is_not_kept(toy: Path) -> None:
    old = Process(toy, "Twice", held=(LOOKS,))
    assert old.says() == LOOKS
    (toy / "factor.py").write_text("FACTOR = 3.0\n")
    assert old.finish() == "30.0 compiled 1", "it goes on as it began"
    assert results(toy, "Twice") == "45.0 compiled 1"


def test_what_was_edited_and_imported_again_is_not_kept_as_what_it_was(toy: Path) -> None:
    process = Process(toy, "Twice", RELOADS, "Halved", held=(RELOADS,))
    assert process.says() == RELOADS
    (toy / "factor.py").write_text("FACTOR = 3.0\n")
    assert process.finish() == "30.0 11.25 compiled 2"
    (toy / "factor.py").write_text(FACTOR)
    assert results(toy, "Halved") == "7.5 compiled 1"
