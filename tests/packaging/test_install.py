"""One version everywhere; pip and colcon both put everything where ROS 2 looks for it."""

import os
import re
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path
from xml.etree import ElementTree

import pip
import pytest
from ament_index_python import get_package_share_directory, get_resource

from tests.waiting import PATIENCE

ROOT = Path(__file__).parents[2]
OUR_BIN = Path(sys.executable).parent

# Each node with a parameter that it must refuse, and what it then says. So it has come far enough
# to need its imports and the installed scenes, and ends by itself.
REFUSED = {
    "drive_sim": ("scene:=no-such-scene", "only-in-this-copy"),
    "profile_controller": ("profile:=no-such-scene", "only-in-this-copy"),
    "recorder": ("queue:=0", "parameter queue"),
}


def run(*command: str | Path, **options) -> subprocess.CompletedProcess[str]:
    """Run to the end, without input; the caller looks at the result."""
    return subprocess.run(
        command,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        **options,
    )


def run_well(*command: str | Path, **options) -> str:
    done = run(*command, **options)
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """What a commit of the present tree would hold, and a scene that tells it from the original."""
    listed = run_well(
        "git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", cwd=ROOT
    )
    copy = tmp_path / "src" / "ab_sim"
    for name in filter(None, listed.split("\0")):
        if (ROOT / name).is_file():  # else deleted and not committed yet
            (copy / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, copy / name)
    scenes = copy / "config" / "scenes"
    shutil.copy(scenes / "thesis-hold.yaml", scenes / "only-in-this-copy.yaml")
    return copy


def assert_installed(prefix: Path, tree: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What `ros2 pkg`, `run` and `launch` look for is in ``prefix``, complete."""
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(prefix))
    assert get_resource("packages", "ab_sim")[1] == str(prefix)
    share = Path(get_package_share_directory("ab_sim"))
    assert (share / "package.xml").read_text() == (tree / "package.xml").read_text()
    for folder, pattern in (
        ("config/scenes", "*.yaml"),
        ("config/nodes", "*.yaml"),
        ("launch", "*.launch.py"),
    ):
        expected = {path.name for path in (tree / folder).glob(pattern)}
        assert {path.name for path in (share / folder).glob(pattern)} == expected
    installed = (prefix / "lib/ab_sim").iterdir()
    runnable = {path.name for path in installed if path.is_file() and os.access(path, os.X_OK)}
    assert runnable == set(REFUSED)


def assert_nodes_run(prefix: Path, environment: dict[str, str]) -> None:
    """Each executable, started as `ros2 run` does, finds its module and its scenes."""
    for node, (parameter, message) in REFUSED.items():
        done = run(prefix / "lib/ab_sim" / node, "--ros-args", "-p", parameter, env=environment)
        assert done.returncode == 2, done.stderr
        assert message in done.stderr


def environment(**changes: str) -> dict[str, str]:
    """Ours, with our Python as the path's `python3`, and no discovery: nobody is to be met."""
    path = os.pathsep.join([str(OUR_BIN), os.environ["PATH"]])
    return {**os.environ, "PATH": path, "ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF", **changes}


def test_version_is_the_same_everywhere(tree: Path) -> None:
    code = (tree / "ab_sim/base/version.py").read_text()
    version = re.search(r'^__version__ = "(.+)"$', code, re.MULTILINE).group(1)
    assert ElementTree.parse(tree / "package.xml").findtext("version") == version
    assert run_well(sys.executable, "setup.py", "--version", cwd=tree).splitlines()[-1] == version


def test_metadata_say_who_and_what(tree: Path) -> None:
    asked = ("--author", "--author-email", "--license", "--description", "--long-description")
    said = run_well(sys.executable, "setup.py", *asked, cwd=tree)
    ros = ElementTree.parse(tree / "package.xml")
    for words in (
        ros.findtext("maintainer"),
        ros.find("maintainer").get("email"),
        "Apache-2.0",
        ros.findtext("description"),
        (tree / "README.md").read_text().splitlines()[2],
    ):
        assert f"{words}\n" in said


def test_why_a_test_is_skipped_is_printed(pytestconfig: pytest.Config) -> None:
    """And launch, of which there is no wheel, can be given to the tests."""
    assert "s" in pytestconfig.option.reportchars
    told = run_well("make", "-n", "test", "LAUNCH=/a:/b", cwd=ROOT)
    calls = re.findall(r"(\S+) \S+ -m pytest", told)
    assert len(calls) > 3 and {*calls} == {"PYTHONPATH=/a:/b"}


def test_type_checkers_find_an_editable_install() -> None:
    """They follow paths in .pth files, and no import hooks."""
    (file,) = Path(sysconfig.get_path("purelib")).glob("__editable__.ab_sim-*.pth")
    assert Path(file.read_text().strip(), "ab_sim/py.typed").is_file()


@pytest.mark.ros
def test_pip_install(tree: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # By way of the source distribution, so that one is complete too.
    run_well(sys.executable, "-m", "build", "--no-isolation", tree)
    (wheel,) = (tree / "dist").glob("*.whl")

    # A Debian without python3-venv has no ensurepip, so the new environment borrows our pip, and
    # pip alone: seeing our packages it would uninstall ab_sim from here.
    prefix = tmp_path / "venv"
    run_well(sys.executable, "-m", "venv", "--without-pip", prefix)
    borrowed = tmp_path / "borrowed"
    borrowed.mkdir()
    (borrowed / "pip").symlink_to(Path(pip.__file__).parent)
    run_well(
        *(prefix / "bin/python", "-m", "pip", "install", "--no-deps", "--no-index", wheel),
        env=environment(PYTHONPATH=str(borrowed)),
    )
    site_packages = Path(
        sysconfig.get_path("purelib", vars={"base": str(prefix), "platbase": str(prefix)})
    )
    (site_packages / "dependencies.pth").write_text(sysconfig.get_path("purelib"))

    assert_installed(prefix, tree, monkeypatch)
    assert (site_packages / "ab_sim/py.typed").exists()
    assert not (site_packages / "gallery").exists()
    paper = run(prefix / "bin/ab-sim", "paper", "thesis", env=environment())
    assert paper.returncode == 2 and "papers are part of" in paper.stderr
    assert len(list((site_packages / "ab_sim/nodes").glob("discovery*.xml"))) == 2
    assert (site_packages / "ab_msgs_py/py.typed").exists()
    # The environment is not activated: the path's python3 is ours, which is not the nodes'.
    assert_nodes_run(prefix, environment())
    assert "only-in-this-copy" in run(prefix / "bin/ab-sim", "run", "no-such-scene").stderr


@pytest.mark.ros
def test_colcon_build(tree: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run_well(OUR_BIN / "colcon", "build", cwd=tmp_path)
    prefix = tmp_path / "install/ab_sim"

    assert_installed(prefix, tree, monkeypatch)
    sourced = run_well("sh", "-c", ". install/setup.sh && env -0", cwd=tmp_path, env=environment())
    assert_nodes_run(prefix, dict(entry.split("=", 1) for entry in sourced.split("\0") if entry))


def test_missing_certificates_are_named_before_pip_needs_them(tmp_path: Path) -> None:
    """Debian's pip needs those of the system, and ends in a traceback without."""
    python = Path("/usr/bin/python3")
    hide = ("mount", "--bind", str(tmp_path), "/etc/ssl/certs")
    debian = Path("/etc/debian_version").exists()
    if not debian or run("unshare", "--mount", *hide).returncode:
        pytest.skip("needs Debian's pip, and the right to hide the system's certificates")
    nobody = tmp_path / "bin/id"  # who is not root: nothing is installed
    nobody.parent.mkdir()
    nobody.write_text("#!/bin/sh\necho 1000\n")
    nobody.chmod(0o755)
    command = (
        f"{' '.join(hide)} && PATH={nobody.parent}:$PATH tools/make-venv {python} {tmp_path}/v"
    )
    done = run("unshare", "--mount", "sh", "-c", command, cwd=ROOT)
    assert done.returncode == 1
    assert "apt-get install ca-certificates" in done.stderr and "Traceback" not in done.stderr


def test_missing_certificates_are_named_before_debian_13s_pip_fails(tmp_path: Path) -> None:
    """That pip reads them when it is imported. apt-get gets a wheel that does the same."""
    source, bin_folder = tmp_path / "wheel/pip", tmp_path / "bin"
    (source / "_vendor").mkdir(parents=True)
    bin_folder.mkdir()
    (source / "__main__.py").write_text("open('/no/such/certificates')\n")
    (source / "_vendor/certifi.py").write_text("where = lambda: '/no/such/certificates'\n")
    for folder in (source, source / "_vendor"):
        (folder / "__init__.py").touch()
    wheel = shutil.make_archive(str(tmp_path / "pip"), "zip", source.parent)
    to = "usr/share/python-wheels"
    commands = {
        "id": "echo 1000",  # who is not root: nothing is installed
        "apt-get": "touch python3-pip-whl_1.deb",
        "dpkg-deb": f"mkdir -p {to} && cp {wheel} {to}/pip-1-py3-none-any.whl",
    }
    for name, command in commands.items():
        (bin_folder / name).write_text(f"#!/bin/sh\n{command}\n")
        (bin_folder / name).chmod(0o755)
    (tmp_path / "ensurepip.py").write_text("raise ImportError\n")
    path = f"{bin_folder}:{os.environ['PATH']}"
    done = run(
        *("tools/make-venv", sys.executable, tmp_path / "venv"),
        cwd=ROOT,
        env=environment(PATH=path, PYTHONPATH=str(tmp_path)),
    )
    assert done.returncode == 1
    assert "apt-get install ca-certificates" in done.stderr and "Traceback" not in done.stderr


def test_interfaces_are_generated_in_any_environment(tmp_path: Path) -> None:
    """ROS's generators look for their templates in AMENT_PREFIX_PATH, which need not be set."""
    tree = tmp_path / "ab_interfaces"
    shutil.copytree(ROOT / "ab_interfaces", tree, ignore=shutil.ignore_patterns("build", "srv"))
    shutil.rmtree(tree / "simulation_interfaces/action")
    for file in (tree / "simulation_interfaces/msg").iterdir():
        if file.stem != "SimulationState":  # one is enough, and takes a second
            file.unlink()
    run_well(sys.executable, "setup.py", "--name", cwd=tree, env=environment(AMENT_PREFIX_PATH=""))
    assert list(tree.glob("build/first/ab_interfaces/**/*.c"))
