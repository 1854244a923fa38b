"""What other programs read of the project: package.xml, CITATION.cff, hooks, links of pages."""

import email
import re
import subprocess
import sys
from glob import glob
from pathlib import Path
from xml.etree import ElementTree

import yaml
from catkin_pkg.package import parse_package

import ab_sim
from tests.waiting import PATIENCE

ROOT = Path(__file__).parents[2]
PACKAGE = ElementTree.parse(ROOT / "package.xml").getroot()
ROSDEP = {
    *("python3-hypothesis", "python3-jsonschema", "python3-matplotlib", "python3-numpy"),
    *("python3-platformdirs", "python3-psutil"),
    *("python3-pydantic", "python3-pytest", "python3-pytest-timeout", "python3-rich"),
    *("python3-scipy", "python3-typer", "python3-yaml"),
}
"""Keys of ros/rosdistro's rosdep/python.yaml, looked up there in its commit 8468e88ccd."""
ROS = {
    *("diagnostic_msgs", "geometry_msgs", "lifecycle_msgs", "rcl_interfaces", "rclpy"),
    *("ros2launch", "rosgraph_msgs", "sensor_msgs", "simulation_interfaces", "std_msgs"),
    *("std_srvs", "tf2_msgs", "trajectory_msgs"),
}
"""Packages of its jazzy and rolling distributions, looked up likewise."""
TITLES = {
    "Reduction Method of Residual Balancing Error in Auto-Balancer and its Motion Analysis",
    "Stability Analysis of a Three-Ball Automatic Balancer",
    "On the relative stability of multi-ball balancing systems",
    "Dynamic analysis of an optical disk drive with an automatic ball balancer",
    "Automatic two-plane balancing for rigid rotors",
}


def test_package_xml_is_what_rep_149_asks_for() -> None:
    """As ROS's own reader judges, which refuses unknown tags, and warns of odd ones."""
    warnings: list[str] = []
    package = parse_package(str(ROOT / "package.xml"), warnings=warnings)
    package.validate(warnings=warnings)
    assert warnings == []
    assert package.package_format == 3
    assert (package.name, package.version) == ("ab_sim", ab_sim.__version__)
    assert package.licenses == ["Apache-2.0"]
    assert (ROOT / package.licenses[0].file).is_file()
    assert [maintainer.email for maintainer in package.maintainers] != []
    assert package.get_build_type() == "ament_python"


def test_the_action_has_a_package_of_the_same_version() -> None:
    """Which colcon builds by CMake, and `make action` by its setup.py."""
    warnings: list[str] = []
    folder = ROOT / "ab_interfaces"
    package = parse_package(str(folder / "package.xml"), warnings=warnings)
    assert warnings == []
    assert (package.name, package.version) == ("ab_interfaces", ab_sim.__version__)
    assert package.get_build_type() == "ament_cmake"
    assert [group.name for group in package.member_of_groups] == ["rosidl_interface_packages"]
    (action,) = folder.glob("action/*.action")
    listed = (folder / "resource/rosidl_interfaces/ab_interfaces").read_text()
    assert listed.split() == [str(action.relative_to(folder))]
    assert f'"{listed.strip()}"' in (folder / "CMakeLists.txt").read_text()


def test_what_package_xml_depends_on_has_a_rosdep_key() -> None:
    depends = {tag.text for tag in PACKAGE if tag.tag.endswith("depend")}
    assert depends - ROSDEP - ROS == set()


def test_what_pip_installs_is_named_for_rosdep_or_beside_it() -> None:
    setup = (ROOT / "setup.py").read_text()
    required = re.search(r"install_requires=\[(.*?)\n    \]", setup, re.DOTALL)
    names = re.findall(r'"([A-Za-z-]+)', required[1])
    assert len(names) > 10
    text = (ROOT / "package.xml").read_text().lower()
    named = {*re.findall(r"[a-z][a-z-]+", text.replace("python3-", ""))}
    assert {name.lower() for name in names} - named == {"pyyaml"}  # python3-yaml


def test_the_citation_names_the_version_and_the_sources() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert (citation["cff-version"], citation["title"]) == ("1.2.0", "ab_sim")
    assert citation["version"] == ab_sim.__version__
    released = f"{citation['version']} ({citation['date-released']})"
    heading = (ROOT / "CHANGELOG.rst").read_text().splitlines()[4:6]
    assert heading == [released, "-" * len(released)]
    assert citation["license"] == PACKAGE.findtext("license")
    assert citation["authors"][0]["email"] == PACKAGE.find("maintainer").get("email")
    assert {source["title"].lower() for source in citation["references"]} == {
        title.lower() for title in TITLES
    }
    heads = [page.read_text().splitlines()[0][2:] for page in ROOT.glob("docs/papers/*.md")]
    assert {head.lower() for head in heads} == {title.lower() for title in TITLES}
    for source in citation["references"]:
        assert (ROOT / source["notes"].rpartition(" ")[2]).is_file()


def test_the_wheel_says_where_to_look(tmp_path: Path) -> None:
    command = [sys.executable, "setup.py", "-q", "egg_info", "--egg-base", str(tmp_path)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True, timeout=PATIENCE)
    (file,) = tmp_path.glob("*/PKG-INFO")
    said = email.message_from_string(file.read_text())
    links = [link.partition(", ")[2] for link in said.get_all("Project-URL")]
    assert all(link.startswith("https://") for link in links)
    assert {url.text for url in PACKAGE.findall("url")} <= set(links)
    assert "Programming Language :: Python :: 3.14" in said.get_all("Classifier")
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert said["Keywords"].split(",") == citation["keywords"]
    peers = re.compile(r"extra == .peers")  # for benchmarks, in any version
    requirements = [each for each in said.get_all("Requires-Dist") if not peers.search(each)]
    required = {name(requirement) for requirement in requirements}
    for release in ("kilted", "jazzy"):
        files = [ROOT / "constraints.txt", ROOT / f"constraints-{release}.txt"]
        lines = [line for file in files for line in file.read_text().splitlines()]
        assert required - {name(line) for line in lines if re.match(r"\w", line)} == set()


def name(requirement: str) -> str:
    """Return the package of a requirement, normalised as in PEP 503."""
    return re.sub(r"[-_.]+", "-", re.match(r"[\w.-]+", requirement)[0]).lower()


def test_workflows_run_targets_that_there_are() -> None:
    """Every supported Python runs the README's two commands."""
    targets = set(re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    jobs = {}
    for file in (ROOT / ".github/workflows").glob("*.yml"):
        jobs |= yaml.safe_load(file.read_text())["jobs"]
    commands = [step["run"] for job in jobs.values() for step in job["steps"] if "run" in step]
    named = [word for text in commands for word in re.findall(r"make ([\w-]+)", text)]
    assert set(named) <= targets
    assert {"demo", "test", "constraints", "lowest", "dist"} == {*named}
    (minors,) = re.findall(r"^MINORS = \((.+)\)", (ROOT / "setup.py").read_text(), re.MULTILINE)
    pythons = {f"3{minor}" for minor in re.findall(r"\.\d+", minors)}
    assert {*jobs["commands"]["strategy"]["matrix"]["python"]} == pythons


def test_hooks_fetch_nothing() -> None:
    config = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text())
    assert [repo["repo"] for repo in config["repos"]] == ["local"]
    hooks = {hook["id"]: hook for hook in config["repos"][0]["hooks"]}
    assert set(hooks) == {"ruff-check", "ruff-format", "mypy"}
    for hook in hooks.values():
        assert hook["language"] == "system"
        assert hook["entry"].startswith(".venv/bin/")


def test_an_image_runs_what_the_readme_names() -> None:
    """It cannot be built here: only what it names is looked at."""
    text = (ROOT / "Dockerfile").read_text()
    for command in ("make demo", "make test", "Not built where it was written"):
        assert command in text
    for source in re.findall(r"^COPY (.+) \S+$", text, re.MULTILINE):
        assert [name for name in source.split() if not glob(name, root_dir=ROOT)] == []
    for target in re.findall(r"make (\.venv/\S+)", text):
        assert target.replace(".venv", "$(VENV)") in (ROOT / "Makefile").read_text()
