"""Outputs are test-written before any work is done, and existing files are not damaged."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from ab_sim.base.errors import InputError
from ab_sim.base.files import check_can_be_made, check_writable, is_being_written, write_whole

NO_FILES = Path("/proc")
"""Folder in which nobody can create files, regardless of its permissions."""


def test_what_is_there_stays_as_it_is(tmp_path: Path) -> None:
    kept = tmp_path / "kept.json"
    kept.write_text("mine")
    os.utime(kept, (1, 1))
    for file in (kept, tmp_path / "new.json"):
        for replaced in (True, False):
            check_writable(file, "--json", replaced)
    assert kept.read_text() == "mine" and kept.stat().st_mtime == 1
    assert list(tmp_path.iterdir()) == [kept]


@pytest.mark.parametrize("replaced", [True, False])
def test_a_place_that_takes_no_files_is_refused(replaced: bool, tmp_path: Path) -> None:
    link = tmp_path / "link.json"
    link.symlink_to(NO_FILES / "r.json")
    for file in (NO_FILES / "r.json", link):
        with pytest.raises(InputError, match=f"--json {file}: cannot be written"):
            check_writable(file, "--json", replaced)


def test_a_file_that_may_not_be_changed_is_refused() -> None:
    with pytest.raises(InputError, match="--json /proc/version: cannot be"):
        check_writable(NO_FILES / "version", "--json")


def test_links_in_a_circle_are_refused(tmp_path: Path) -> None:
    for one, other in (("a.json", "b.json"), ("b.json", "a.json")):
        (tmp_path / one).symlink_to(tmp_path / other)
    with pytest.raises(InputError, match="--json .*a.json: cannot be written"):
        check_writable(tmp_path / "a.json", "--json")


def test_a_full_disk_is_found_before_the_run(tmp_path: Path) -> None:
    """Use a run that would diverge with exit code 3, if it were started."""
    diverges = ("rotor.eccentricity=1", "race.radius=0.002", "effects.rolling_friction=")
    run = ("run", "thesis-baseline", *(word for each in diverges for word in ("--set", each)))
    limited = "import resource, sys; resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0));"
    code = f"{limited} from ab_sim.cli import main; sys.argv[0] = 'ab-sim'; main()"
    for output in ("--json", "r.json"), ("--plot", "r.png"), ("--rrd", "r.rrd"):
        done = subprocess.run(
            [sys.executable, "-c", code, *run, *output],
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, cwd=tmp_path,
        )  # fmt: skip
        assert done.returncode == 2, done.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_folder_is_not_made_before_there_is_something_in_it(tmp_path: Path) -> None:
    folder = tmp_path / "made" / "papers"
    check_can_be_made(folder, "--out")
    assert list(tmp_path.iterdir()) == []
    write_whole(folder / "page.md", b"text")
    assert [path.name for path in folder.iterdir()] == ["page.md"]
    for wrong in (folder / "page.md" / "more", NO_FILES / "papers"):
        with pytest.raises(InputError, match=f"--out {wrong}: cannot be created"):
            check_can_be_made(wrong, "--out")


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    target, link = tmp_path / "target.json", tmp_path / "link.json"
    link.symlink_to(target)
    for text in (b"one", b"two"):
        write_whole(link, text)
        assert link.is_symlink() and target.read_bytes() == text


def test_a_long_name_can_be_written(tmp_path: Path) -> None:
    file = tmp_path / f"{'n' * 245}.json"
    check_writable(file, "--json")
    write_whole(file, b"text")
    assert file.read_bytes() == b"text"


def test_who_only_looks_at_a_file_is_no_writer(tmp_path: Path) -> None:
    fcntl = pytest.importorskip("fcntl")
    file = tmp_path / "bag.mcap"
    file.write_bytes(b"whole")
    with file.open("rb") as other:
        fcntl.flock(other, fcntl.LOCK_SH)
        assert not is_being_written(file), "another process is looking, too"
        fcntl.flock(other, fcntl.LOCK_EX)
        assert is_being_written(file)
    assert not is_being_written(file)
