"""test_fast.py [BASE]: run tests of changes since BASE, and a core, in less than two minutes.

BASE is a commit; default: the common ancestor of main and this branch, or on main its last commit.
The tests left out are reported at the end. This file is also the pytest plugin that keeps the time.
"""

import functools
import os
import re
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
TESTS = ROOT / "tests"
SECONDS = 85.0
"""Time after which no test begins [s]; the last tests and the summary take more time."""
UNTIL, FILES = "AB_SIM_TEST_FAST_UNTIL", "AB_SIM_TEST_FAST_FILES"
NO_TIME = "no time left"

CORE = (
    "tests/test_rooms.py",
    "tests/test_docs.py",
    "tests/scene/test_load.py",
    "tests/effects/test_laws.py",
    "tests/dynamics/test_planar.py",
    "tests/drive/test_drive.py",
)
"""Tests that always run, before the others."""
ALSO = {
    "equations": ("effects", "dynamics", "formulas", "tracing"),
    "kernels": ("integrate", "drive"),
    "stepping": ("integrate",),
    "api": ("test_public_api.py",),
}
"""Folders of tests of a package, in addition to the folder with its name."""
ELSEWHERE = {
    "ab_msgs_py": ("tests/msgs",),
    "config": ("tests/scene", "tests/deck/test_scenes_that_ship.py"),
    "docs": ("tests/test_docs.py", "tests/formulas/test_page.py", "tests/msgs/test_topics_page.py"),
    "examples": ("tests/examples",),
    "launch": ("tests/packaging",),
    "scripts": ("tests/packaging",),
    "tools": ("tests/packaging",),
    "": ("tests/packaging",),
}
"""Tests of files outside the package, by folder; "" is the root."""


def changed_files(base: str | None) -> list[str]:
    """Return the files that differ from the commit, including uncommitted and untracked ones."""
    if base is None:
        base = _git("merge-base", "HEAD", "main") or "HEAD"
    changed = _git("diff", "--name-only", base) or ""
    new = _git("ls-files", "--others", "--exclude-standard") or ""
    return sorted({*changed.splitlines(), *new.splitlines()})


def _git(*arguments: str) -> str | None:
    done = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True)
    return done.stdout.strip() if done.returncode == 0 else None


def tests_of(changed: Iterable[str]) -> list[str]:
    """Return test files: core, changed ones, importers of changed files, rest of their packages."""
    own, files, folders = [], [], []
    for name in changed:
        path = Path(name)
        top = path.parts[0] if len(path.parts) > 1 else ""
        if top == "tests":
            own.append(name if path.name.startswith("test_") else str(path.parent))
        elif top == "ab_sim":
            files += _importers(path)
            for package in path.with_suffix("").parts[1:3]:
                folders += [f"tests/{folder}" for folder in (package, *ALSO.get(package, ()))]
        else:
            folders += ELSEWHERE.get(top, ())
    own = [
        name for name in own if name != "tests"
    ]  # a helper of all tests would select all of them
    paths = (*CORE, *own, *files, *folders)
    ordered = [file for path in paths for file in _test_files(ROOT / path)]
    return list(dict.fromkeys(str(file.relative_to(ROOT)) for file in ordered))


def _importers(path: Path) -> list[str]:
    """Return the tests that import a module."""
    parts = path.with_suffix("").parts
    module = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
    package, _, name = module.rpartition(".")
    named = re.compile(rf"from {re.escape(module)} |import {re.escape(module)}\b")
    # `from package import module`, on one line or several
    inside = re.compile(rf"from {re.escape(package)} import (\([^)]*|[^\n(]*)\b{name}\b")
    texts = _texts_of_tests().items()
    return [name for name, text in texts if named.search(text) or inside.search(text)]


@functools.cache
def _texts_of_tests() -> dict[str, str]:
    """Return the texts of all test files by name."""
    files = _test_files(TESTS)
    return {str(file.relative_to(ROOT)): file.read_text(encoding="utf-8") for file in files}


def _test_files(path: Path) -> list[Path]:
    if path.is_dir():
        return sorted(path.rglob("test_*.py"))
    return [path] if path.is_file() else []


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip the test when the time is over, in every process that runs tests."""
    if time.time() > float(os.environ[UNTIL]):
        pytest.skip(NO_TIME)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Report the tests that did not run."""
    skipped = terminalreporter.stats.get("skipped", [])
    late = [report for report in skipped if NO_TIME in str(report.longrepr)]
    ran = {str(Path(file)) for file in os.environ[FILES].split()}
    others = [file for file in _test_files(TESTS) if str(file.relative_to(ROOT)) not in ran]
    folders = sorted({file.relative_to(TESTS).parts[0] for file in others})
    write = terminalreporter.write_line
    terminalreporter.section("left out; `make test` runs all")
    write("lint and types (`make lint`), and tests that start ROS 2 nodes (marked ros)")
    write(f"{len(others)} of {len(ran) + len(others)} test files, in: {', '.join(folders)}")
    if late:
        counts = Counter(Path(report.nodeid.partition("::")[0]).parts[1] for report in late)
        shown = ", ".join(f"{folder} {count}" for folder, count in sorted(counts.items()))
        write(f"no time was left for {len(late)} more tests: {shown}")


def main() -> int:
    """Run the tests; return pytest's exit code."""
    changed = changed_files(sys.argv[1] if len(sys.argv) > 1 and sys.argv[1] else None)
    files = tests_of(changed)
    print(f"{len(changed)} files changed, {len(files)} test files", flush=True)
    environment = {
        **os.environ,
        UNTIL: str(time.time() + SECONDS),
        FILES: " ".join(files),
        "PYTHONPATH": os.pathsep.join(filter(None, (str(ROOT / "tools"), os.getenv("PYTHONPATH")))),
    }
    # Keep the order of the files, so that the tests closest to the changes run in the limited time.
    how = [
        "-q",
        "-n",
        "2",
        "--dist",
        "loadfile",
        "--no-loadscope-reorder",
        "-m",
        "not ros",
        "-rfEs",
    ]
    command = [sys.executable, "-m", "pytest", "-p", "test_fast", *how, *files]
    return subprocess.run(command, cwd=ROOT, env=environment).returncode


if __name__ == "__main__":
    sys.exit(main())
