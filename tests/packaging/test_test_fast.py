"""`make test-fast` finds the tests of what was touched."""

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.waiting import PATIENCE

ROOT = Path(__file__).parents[2]
spec = importlib.util.spec_from_file_location("test_fast", ROOT / "tools" / "test_fast.py")
fast = importlib.util.module_from_spec(spec)
spec.loader.exec_module(fast)


@pytest.mark.parametrize(
    ("touched", "wanted"),
    [
        ("ab_sim/scene/keys.py", "tests/scene/test_keys.py"),
        ("ab_sim/scene/keys.py", "tests/scene/test_load.py"),
        ("ab_sim/cli/lists.py", "tests/scene/test_effects.py"),  # imports it
        ("ab_sim/scene/registry.py", "tests/scene/test_effects.py"),
        ("ab_sim/model/equations/planar.py", "tests/dynamics/test_planar.py"),
        ("ab_sim/base/errors.py", "tests/scene/test_keys.py"),
        ("tests/sensing/test_pickup.py", "tests/sensing/test_pickup.py"),
        ("tests/effects/parts.py", "tests/effects/test_five_parts.py"),
        ("config/scenes/thesis-hold.yaml", "tests/deck/test_scenes_that_ship.py"),
        ("docs/equations.md", "tests/formulas/test_page.py"),
        ("setup.py", "tests/packaging/test_install.py"),
    ],
)
def test_what_was_touched_is_tested(touched: str, wanted: str) -> None:
    assert wanted in fast.tests_of([touched])


def test_the_core_comes_first_then_changed_tests_then_neighbours() -> None:
    found = fast.tests_of(["ab_sim/drive/pickup.py", "tests/spindle/test_servo.py"])
    assert found[: len(fast.CORE) + 1] == [*fast.CORE, "tests/spindle/test_servo.py"]
    assert "tests/sensing/test_pickup.py" in found
    assert "tests/nodes/test_pacing.py" not in found


def test_names_in_the_script_are_there() -> None:
    assert fast.tests_of([]) == list(fast.CORE)
    folders = [f"tests/{name}" for also in fast.ALSO.values() for name in also]
    elsewhere = [name for names in fast.ELSEWHERE.values() for name in names]
    for name in (*fast.CORE, *folders, *elsewhere):
        assert (ROOT / name).exists(), name
    for room in fast.ALSO:
        assert list((ROOT / "ab_sim").glob(f"**/{room}/__init__.py")), room


@pytest.mark.parametrize("room", sorted(path.name for path in (ROOT / "ab_sim").glob("[a-z]*/")))
def test_every_room_has_tests_of_its_own(room: str) -> None:
    modules = (ROOT / "ab_sim" / room).rglob("[a-z]*.py")
    names = (str(path.relative_to(ROOT)) for path in modules)
    assert any(len(fast.tests_of([name])) > len(fast.CORE) for name in names)


def test_what_there_is_no_time_for_is_skipped_and_said() -> None:
    environment = {**os.environ, fast.UNTIL: "0", fast.FILES: "tests/test_ordered_sums.py"}
    environment["PYTHONPATH"] = os.pathsep.join([str(ROOT / "tools"), os.getenv("PYTHONPATH", "")])
    how = ("-p", "test_fast", "-q", "-n", "1", "tests/test_ordered_sums.py")
    command = [sys.executable, "-m", "pytest", *how]
    done = subprocess.run(
        command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=PATIENCE
    )
    assert done.returncode == 0, done.stdout
    assert " passed" not in done.stdout
    for words in (
        "no time left",
        "no time was left for",
        "test files, in: accuracy, analysis",
        "marked",
    ):
        assert words in done.stdout
