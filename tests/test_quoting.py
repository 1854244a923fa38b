"""Text from outside: control characters are escaped, and long values are shortened."""

import os
import pty
import shutil
import subprocess
import sys
from pathlib import Path
from xml.dom import minidom

import pytest
from matplotlib.figure import Figure

from ab_sim.base.errors import MOST, SceneError, short, visible
from ab_sim.cli.outputs import PlainConsole
from ab_sim.record.recording import Recording
from ab_sim.scene import find_scene, load_scene
from ab_sim.show.saved import save
from tests.recording.runs import describe, run

RED = "\x1b[31m"


def test_what_a_terminal_would_obey_is_written_out() -> None:
    assert visible("W/e, 5\u00a0°, 球, \ttwo\nlines") == "W/e, 5\u00a0°, 球, \ttwo\nlines"
    assert visible(f"{RED}a\rb\x9bc\u202ed\x07") == "\\x1b[31ma\\rb\\x9bc\\u202ed\\x07"
    assert visible("\udcff") == "\\udcff", "of a file's name that is no UTF-8"
    assert visible(visible(RED)) == visible(RED)


def test_long_values_are_cut() -> None:
    assert short(["a", 1]) == "['a', 1]"
    assert len(short("x" * 10**6)) < MOST + 10
    assert short(10**5000) == "<int of too many digits to write>"
    assert short([1, -(10**5000)]) == "<list of too many digits to write>"


def test_what_is_printed_for_people(capsys: pytest.CaptureFixture[str]) -> None:
    PlainConsole().print(f"{RED}[/]", end="")
    assert capsys.readouterr().out == "\\x1b[31m[/]"


@pytest.mark.parametrize("key", ["name", "description", "source", "assumed"])
def test_words_of_a_scene_hold_no_control_characters(key: str) -> None:
    text = '["\\e[31m"]' if key == "assumed" else '"\\e[31m"'
    with pytest.raises(SceneError) as refused:
        load_scene("no-ball", [f"{key}={text}"])
    assert "no control characters" in str(refused.value)
    assert "\x1b" not in str(refused.value)


def test_a_name_is_one_line() -> None:
    with pytest.raises(SceneError, match="must be one line"):
        load_scene("no-ball", ['name="a\\nb"'])
    assert load_scene("no-ball", ['description="a\\nb"']).description == "a\nb"


def test_pictures_show_names_as_they_are(tmp_path: Path) -> None:
    """Names are not parsed as formulas, which might be invalid, and the SVG is valid."""
    figure = Figure()
    axes = figure.subplots()
    axes.loglog([1e-3, 1.0], [1.0, 1e3], label=f"{RED} $x$")
    axes.legend()
    figure.suptitle("$\\nonsense$")
    save(figure, tmp_path / "a.svg", 50)
    minidom.parse(str(tmp_path / "a.svg"))
    assert not figure.texts[0].get_parse_math()
    assert axes.xaxis.get_major_ticks()[0].label1.get_parse_math(), "powers of ten"


def on_a_terminal(*arguments: str, cwd: Path) -> bytes:
    """Return the output of a command on a terminal without colours."""
    ours, its = pty.openpty()
    command = [sys.executable, "-m", "ab_sim", *arguments]
    environment = os.environ | {"TERM": "dumb", "COLUMNS": "200"}
    with subprocess.Popen(command, stdout=its, stderr=its, cwd=cwd, env=environment) as process:
        os.close(its)
        said = b""
        while True:
            try:
                part = os.read(ours, 4096)
            except OSError:  # the command has exited
                break
            if not part:
                break
            said += part
    os.close(ours)
    assert process.returncode in (0, 2) and b"Traceback" not in said
    return said


def test_on_a_terminal(tmp_path: Path) -> None:
    """Use keys of a scene, names of files, and a recording's description."""
    (tmp_path / "key.yaml").write_text('"\\e[31mkey": 1\n' + find_scene("no-ball").read_text())
    shutil.copy(find_scene("no-ball"), tmp_path / f"{RED}.yaml")
    told = load_scene("no-ball").as_mapping()
    told = describe(0, scene=told | {"name": f"{RED}[/]"})
    with Recording(tmp_path / f"{RED}.rrd", description=told) as recording:
        recording.block(*run(1000, 0))
    for arguments, words in (
        (("check", "key.yaml"), rb"\x1b[31mkey = 1: not known here"),
        (("check", f"{RED}.yaml"), rb"name = '\x1b[31m': must contain no control characters"),
        (("check", f"--{RED}"), rb"No such option: --\x1b[31m"),
        (("report", f"{RED}.rrd", "--html", f"{RED}.html"), rb"wrote \x1b[31m.html"),
    ):
        said = on_a_terminal(*arguments, cwd=tmp_path)
        assert words in said and b"\x1b[31m" not in said
    assert "\x1b" not in (tmp_path / f"{RED}.html").read_text()


@pytest.mark.ros
def test_in_a_nodes_log(domain: int) -> None:
    pytest.importorskip("rclpy", reason="needs ROS 2")
    program = (
        "from ab_sim.nodes.process import init_ros\n"
        "from ab_sim.nodes.base_node import BaseNode\n"
        "init_ros(['talker'])\n"
        "log = BaseNode('talker').get_logger()\n"
        "for say in (log.info, log.warning, log.error):\n"
        "    say(say.__name__ + chr(27) + '[31m')\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
        env=os.environ | {"ROS_DOMAIN_ID": str(domain), "RCUTILS_COLORIZED_OUTPUT": "0"},
        check=True,
    )
    for word in ("info", "warning", "error"):
        assert f"{word}\\x1b[31m" in done.stderr
    assert "\x1b" not in done.stderr
