"""Code on documentation pages runs; files and commands named there exist."""

import re
import runpy
import shlex
import shutil
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import yaml
from typer.main import get_command
from typer.testing import CliRunner

from ab_sim.base.errors import SceneError
from ab_sim.cli.app import app
from ab_sim.scene import check_scene, load_scene
from ab_sim.scene.load import load_profile
from ab_sim.scene.registry import effect_classes

pytestmark = pytest.mark.long

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", *sorted(set(DOCS.rglob("*.md")) - set(DOCS.glob("_build/**/*.md")))]
NAMES = [str(page.relative_to(ROOT)) for page in PAGES]

RUN = {
    "c", "check", "compare", "effects", "equilibria", "export", "import", "modes", "report", "run",
    "scenes", "sensors", "state", "urdf",
}  # fmt: skip
"""Commands of ab-sim that are run. Others take long, open a window, or need nodes: their arguments
are parsed here, and other tests run them."""


def blocks(page: str, language: str) -> list[str]:
    text = (ROOT / page).read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.DOTALL | re.MULTILINE)


def with_blocks(language: str) -> list[str]:
    return [page for page in NAMES if blocks(page, language)]


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Create the files that pages assume the reader to have."""
    folder = tmp_path_factory.mktemp("files")
    (folder / "my-drive.yaml").write_text(blocks("docs/tutorials/own-drive.md", "yaml")[0])
    (folder / "my-scene.yaml").write_text(blocks("docs/howto/scene.md", "yaml")[0])
    ran = invoke("run", "thesis-hold", "--rrd", str(folder / "run.rrd"))
    assert ran.exit_code == 0, ran.output
    shutil.copy(folder / "run.rrd", folder / "other.rrd")
    return folder


@pytest.fixture
def there(files: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Copy these files to a new working directory."""
    folder = tmp_path / "reader"
    shutil.copytree(files, folder)
    monkeypatch.chdir(folder)
    return folder


def invoke(*words: str) -> Any:
    return CliRunner().invoke(app, words, catch_exceptions=False)


@pytest.mark.parametrize("page", with_blocks("python"))
def test_python_runs(page: str, there: Path) -> None:
    exec(compile("\n".join(blocks(page, "python")), page, "exec"), {"__name__": "page"})


@pytest.mark.parametrize("page", with_blocks("yaml"))
def test_yaml_is_a_scene_or_a_part_of_one(page: str, tmp_path: Path) -> None:
    for block in blocks(page, "yaml"):
        part = yaml.safe_load(block)
        if "rotor" in part:
            check_scene(part, origin=page)
        elif "kind" in part:
            (tmp_path / "profile.yaml").write_text(block)
            load_profile(str(tmp_path / "profile.yaml"))
        else:
            check_scene({**load_scene("no-ball").as_mapping(), **part}, origin=page)


def test_readme_has_the_drive_of_the_tutorial() -> None:
    ours, tutorials = (
        yaml.safe_load(blocks(page, "yaml")[0])
        for page in ("README.md", "docs/tutorials/own-drive.md")
    )
    assert ours == tutorials


def test_the_error_of_the_tutorial_is_what_is_said(tmp_path: Path) -> None:
    page = "docs/tutorials/own-drive.md"
    (tmp_path / "my-drive.yaml").write_text(blocks(page, "yaml")[0].replace("mass: 5", "mas: 5"))
    with pytest.raises(SceneError) as raised:
        load_scene(tmp_path / "my-drive.yaml")
    said = str(raised.value).replace(f"{tmp_path}/", "")
    assert blocks(page, "text")[0] == f"ab-sim: {said}\n"


@pytest.mark.parametrize("page", with_blocks("bash"))
def test_commands_run_or_are_such(page: str, there: Path) -> None:
    for block in blocks(page, "bash"):
        for line in block.splitlines():
            try:
                command(line)
            except (AssertionError, Exception) as error:
                raise AssertionError(f"{page}: {line}: {error}") from error


def command(line: str) -> str:
    """Run a command line, or only parse it if it is not in ``RUN``; return its output."""
    inner = re.search(r"\$\((.*?)\)", line)
    if inner:
        line = line.replace(inner[0], command(inner[1]).strip())
    words = shlex.split(line, comments=True)
    match words:
        case [".venv/bin/ab-sim", *arguments]:
            return ab_sim_command(arguments)
        case ["make", target]:
            assert re.search(rf"^{target}:", (ROOT / "Makefile").read_text(), re.MULTILINE)
        case ["ros2", "run", "ab_sim", node, *arguments]:
            assert (ROOT / "scripts" / node).exists()
            check_node(node, arguments)
        case [".venv/bin/python", "-m", module, *arguments]:
            assert (ROOT / module.replace(".", "/")).with_suffix(".py").exists()
            check_node(module.rpartition(".")[2], arguments)
        case [".venv/bin/python", file]:
            assert (ROOT / file).exists()
        case ["ros2", "launch", "ab_sim", file, *arguments]:
            launch = (ROOT / "launch" / file).read_text()
            assert all(f'"{argument.partition(":=")[0]}"' in launch for argument in arguments)
        case ["ros2", "param", "set", node, parameter, value]:
            check_parameter(node.strip("/"), parameter, value)
        case ["ros2", "service", "call", service, kind]:
            node, name = service.strip("/").split("/")
            assert re.search(rf"^\| `~/{name}` \| {kind} \| {node} \|", topics(), re.MULTILINE)
        case ["ros2", "service", "call", service, kind, request]:  # with tests of its own
            assert f"`~/{service.removeprefix('/drive_sim/')}`" in topics()
            check_fields(f"ab_interfaces/{kind}.srv", request)
        case ["ros2", "action", "send_goal", "/drive_sim/simulate_steps", kind, goal, "--feedback"]:
            check_fields(f"ab_interfaces/{kind}.action", goal)
        case ["ros2", "topic", "pub", "--once", topic, kind, message]:
            assert re.search(rf"^\| `{topic.strip('/')}` \| {kind} \|", topics(), re.MULTILINE)
            assert isinstance(yaml.safe_load(message), dict)
        case ["ros2", "action", "send_goal", "--feedback", "/profile_controller/run", kind, goal]:
            check_fields(f"{kind}.action", goal)
        case _:
            raise AssertionError("nothing that this test knows")
    return ""


def topics() -> str:
    return (DOCS / "topics.md").read_text(encoding="utf-8")


def check_fields(definition: str, request: str) -> None:
    asked = (ROOT / definition).read_text(encoding="utf-8").partition("---\n")[0]
    assert all(re.search(rf"^\S+ {field}\b", asked, re.M) for field in yaml.safe_load(request))


def check_node(node: str, arguments: list[str]) -> None:
    assert arguments[0] == "--ros-args" and len(arguments) % 2
    for flag, value in zip(arguments[1::2], arguments[2::2], strict=True):
        name, sign, given = value.partition(":=")
        assert sign and flag in ("-p", "-r")
        if flag == "-p" and name != "use_sim_time":
            check_parameter(node, name, given)


def check_parameter(node: str, name: str, given: str) -> None:
    values = yaml.safe_load((ROOT / f"config/nodes/{node}.yaml").read_text())
    default = values["/**"]["ros__parameters"][name]
    assert isinstance(yaml.safe_load(given), type(default))


@cache
def parser() -> Any:
    return get_command(app)


def ab_sim_command(words: list[str]) -> str:
    loads = words[0] == "--load"
    if loads:
        words = words[2:]
    name, *arguments = words
    parsed, rest = parser().commands[name], arguments
    context = None
    while hasattr(parsed, "commands"):
        context = parsed.context_class(parsed, info_name="ab-sim", parent=context)
        parsed, rest = parsed.commands[rest[0]], rest[1:]
    parsed.make_context(name, list(rest), parent=context)  # refuses unknown arguments
    if name not in RUN or loads:
        return ""
    done = invoke(*words)
    assert done.exit_code == 0, done.output
    return str(done.stdout)


@pytest.mark.parametrize("page", [*NAMES, "CONTRIBUTING.md", "SECURITY.md"])
def test_pages_name_files_that_are_there(page: str) -> None:
    text = (ROOT / page).read_text(encoding="utf-8")
    links = re.findall(r"\]\((?!https?:|#)([^)#\s]+)", text)
    assert [link for link in links if not ((ROOT / page).parent / link).exists()] == []


@pytest.mark.parametrize("page", NAMES)
def test_no_line_is_lost_on_the_site(page: str) -> None:
    """MyST takes a line that begins with % for a comment, such as one that continues "16 %"."""
    assert not re.search(r"^\s*%", (ROOT / page).read_text(encoding="utf-8"), re.M)


@pytest.mark.parametrize("page", NAMES)
def test_benchmarks_that_pages_name_are_there(page: str) -> None:
    named = re.findall(r"benchmarks/\w+\.py", (ROOT / page).read_text(encoding="utf-8"))
    assert [file for file in named if not (ROOT / file).exists()] == []


def test_readme_is_short_and_leads_to_every_part() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 100
    for folder in ("tutorials", "howto", "explanation", "reference", "gallery"):
        assert f"](docs/{folder}/" in text
    for page in (*DOCS.glob("howto/*.md"), *DOCS.glob("tutorials/*.md")):
        guide = page.stem.startswith("firmware-")  # README leads to the text that it includes
        if page.stem not in ("index", "effect-cost") and not guide:
            assert f"]({page.relative_to(ROOT)}" in text, page


def words_of(page: Path) -> int:
    """Return the number of words outside the parts that follow from the code."""
    text = page.read_text(encoding="utf-8")
    for parts in (
        r"<!-- from code: .*?<!-- to here -->",
        r"<!-- (\w+): made by .*?<!-- \1: end -->",
    ):
        text = re.sub(parts, "", text, flags=re.DOTALL)
    return sum(bool(re.search("[A-Za-z]", word)) for word in text.split())


def test_pages_stay_short() -> None:
    words = sum(words_of(page) for page in PAGES if DOCS in page.parents)
    assert words <= 44_355, "shorten another text in docs/; parts from code do not count"
    assert words_of(DOCS / "design-notes.md") <= 2_000
    assert len((ROOT / "CHANGELOG.rst").read_text(encoding="utf-8").splitlines()) <= 60


def test_reference_pages_are_current(monkeypatch: pytest.MonkeyPatch) -> None:
    """After a change of a help text, key, effect, metric or parameter, write them again."""
    script = "docs/extensions/from_code.py"
    monkeypatch.syspath_prepend(ROOT / "docs/extensions")
    current = runpy.run_path(str(ROOT / script))["current"]
    texts = {page: page.read_text(encoding="utf-8") for page in PAGES}
    stale = [page.name for page, text in texts.items() if text != current(text)]
    assert stale == [], f"run {script}"


def test_every_effect_has_a_row_in_the_table_of_effects() -> None:
    page = "docs/reference/effects.md"
    rows = re.findall(r"^\| (`.*?`) \|", (ROOT / page).read_text(encoding="utf-8"), re.MULTILINE)
    named = {name for row in rows for name in re.findall(r"`(\w+)`", row)}
    assert named == set(effect_classes()), f"{page}: a row for each effect, and for no other"
