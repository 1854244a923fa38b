"""The kernel cache: another key for other sources, and a folder wherever one can be had."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import ab_sim
from ab_sim.integrate.compile_cache import cache_folder


def test_folder_follows_the_environment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache_folder().parent == tmp_path / "ab_sim"
    assert cache_folder() == cache_folder()


def test_unwritable_home_is_no_obstacle(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    in_the_way = tmp_path / "file"
    in_the_way.write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(in_the_way))
    assert cache_folder().is_dir()


def test_an_edited_constant_never_meets_a_stale_kernel(tmp_path: Path) -> None:
    """A copy of the package, run, edited in an effect, run again with the same cache."""
    package = tmp_path / "ab_sim"
    shutil.copytree(Path(ab_sim.__file__).parent, package)
    shutil.copytree(Path(ab_sim.__file__).parents[1] / "config", tmp_path / "config")
    program = (
        "from ab_sim.drive import Drive; from ab_sim.scene import load_scene; "
        "d = Drive(load_scene('thesis-baseline', ['effects.rolling_friction='])); "
        "d.advance(2500); print(d.observe().theta[0])"
    )

    def run() -> float:
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
        return float(done.stdout)

    first = run()
    assert run() == first
    effect = package / "dynamics" / "effects" / "ball_spin.py"
    text = effect.read_text()
    assert "return 0.4 * ball.mass  # I / a^2" in text
    effect.write_text(text.replace("return 0.4 * ball.mass  #", "return 0.5 * ball.mass  #"))
    assert run() != first
