"""The files of `ab-sim c`: what is in them, where they go, and which scenes are refused."""

import errno
import platform
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from ab_sim.base.errors import InputError, SceneError
from ab_sim.export.c_code.sources import NAMES, sources_of, write_sources
from ab_sim.scene import load_scene
from tests.c_code.compiled import STRICT, needs_compiler
from tests.cli.tool import ab_sim, refused

THESIS = ("thesis-hold", ["effects.rolling_friction="])


@needs_compiler
def test_a_stranger_builds_and_runs_them(tmp_path: Path) -> None:
    """As README.md there says, without CMake."""
    words = ("thesis-hold", "--set", "effects.rolling_friction=")
    done = ab_sim("c", *words, "--out", "drive", "--fmu", "drive.fmu", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "binary for" in done.stdout and "wrote drive/drive.c" in done.stderr
    assert done.stdout.splitlines()[-1].endswith("in C: begin with drive/README.md")
    folder = tmp_path / "drive"
    line = next(x for x in (folder / "README.md").read_text().splitlines() if " cc -std" in x)
    for program in ("drive_example", "drive_check"):
        own = line.replace("drive_example", program)
        own = own.replace("main.c", "drive_check.c") if program == "drive_check" else own
        subprocess.run(own.split(), cwd=folder, check=True)
    checked = subprocess.run([folder / "drive_check"], capture_output=True, text=True)
    assert (checked.returncode, checked.stdout[:22]) == (0, "the same bits as ab_si")
    ran = subprocess.run([folder / "drive_example", "60", "3"], capture_output=True, text=True)
    lines = ran.stdout.splitlines()
    assert len(lines) == 301 and lines[-1].startswith("3.0000,60.0000,")
    wrong = subprocess.run([folder / "drive_example", "1e6"], capture_output=True, text=True)
    assert (wrong.returncode, "must be within +-420" in wrong.stderr) == (2, True)
    for words in (["--help"], ["60", "3s"], ["60", "3", "1"], ["60", "-3"], ["60", "nan"]):
        wrong = subprocess.run([folder / "drive_example", *words], capture_output=True, text=True)
        assert (wrong.returncode, wrong.stdout, wrong.stderr[:6]) == (2, "", "usage:")
    assert "rolling_friction" not in (folder / "README.md").read_text()
    assert re.search("Effects: .*suspension", (folder / "README.md").read_text())


@needs_compiler
def test_the_check_notices_another_bit(tmp_path: Path) -> None:
    sources = sources_of(load_scene(*THESIS))
    write_sources(sources, tmp_path, "--out")
    check = tmp_path / "drive_check.c"
    check.write_text(check.read_text().replace("p-", "p-1", 1))
    words = "cc -std=c99 -ffp-contract=off drive.c drive_check.c -o check -lm"
    subprocess.run(words.split(), cwd=tmp_path, check=True)
    found = subprocess.run([tmp_path / "check"], capture_output=True, text=True)
    assert found.returncode == 1 and "not the same bits as ab_sim" in found.stdout


def test_what_a_scene_does_not_name_is_not_in_the_code() -> None:
    whole = sources_of(load_scene(*THESIS)).files["drive.c"]
    changes = [*THESIS[1], "effects.viscous_drag=", "effects.ball_spin=", "balls.radius="]
    less = sources_of(load_scene("thesis-hold", changes)).files["drive.c"]
    for word in ("viscous_drag_coefficient", "ball_radius"):
        assert word in whole and word not in less
    for word in ("RAISED_COSINE)", "sense(", "quaternion", "restitution", "motor", "gravity"):
        assert word not in whole
    assert len(less.splitlines()) < len(whole.splitlines())


METACHARACTERS = (
    "*@LIMITS@/ int main; /@LIMITS@* a@FOO@b @STEP@ */ int main; /* *\\/ // ???/ ??> \\ \" ' %s %n "
    "#error x #]] ]] [[ [=[ ) ( ${HOME} $ENV{HOME} $<1:x> ; --> --!> -- ]]> <script>alert(1)"
    "</script> <!-- <?php &lt; & </title> ![x](javascript:x) [x](y) `x` *x* _x_ ~x~ | x | http://x "
    "\x01 \ufffe \u202e end \\"
)
"""Those of C, CMake, XML, HTML and Markdown, and names of this package's templates."""


def tokens_of_c(text: str) -> list[str]:
    """Return C code without its comments, by a compiler's own preprocessor."""
    words = ["cc", "-std=c99", "-fpreprocessed", "-dD", "-E", "-P", "-"]
    ran = subprocess.run(words, input=text, capture_output=True, text=True, check=True)
    return ran.stdout.split()


@needs_compiler
@pytest.mark.parametrize("text", [METACHARACTERS, "??/", "\\"])
def test_words_of_a_scene_stay_words(text: str, tmp_path: Path) -> None:
    scene = load_scene(*THESIS)
    plain = sources_of(scene).files
    evil = sources_of(
        scene.model_copy(update={"description": text, "name": text, "source": text})
    ).files
    for name, content in plain.items():
        (tmp_path / name).write_text(evil[name])
        assert "\x01" not in evil[name] and "\u202e" not in evil[name]
        if name.endswith((".c", ".h")):
            assert tokens_of_c(evil[name]) == tokens_of_c(content)
    assert evil["CMakeLists.txt"].startswith("# Made by")
    assert evil["CMakeLists.txt"].splitlines()[1:] == plain["CMakeLists.txt"].splitlines()[1:]
    first, title, *rest = evil["README.md"].splitlines()
    assert rest == plain["README.md"].splitlines()[2:]
    assert first.startswith("<!-- ") and first.endswith(" -->") and first.count("-->") == 1
    assert not re.search(r"[][<>`*_&|]", re.sub(r"\\.", "", title))
    words = ["cc", *STRICT, "-fsyntax-only", "drive.c", "main.c", "drive_check.c"]
    checked = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True)
    assert checked.returncode == 0, checked.stderr


def test_a_scene_file_s_description_is_no_code() -> None:
    """The text that ran a command when its drive was built."""
    text = sources_of(load_scene(str(Path(__file__).with_name("evil-description.yaml"))))
    assert "__attribute__((constructor))" in text.files["drive.h"]
    assert "system" not in " ".join(tokens_of_c(text.files["drive.h"]))


@needs_compiler
@pytest.mark.parametrize("standard", ["c++98", "c++11", "c++14", "c++17", "c++20"])
def test_the_header_compiles_as_cpp(standard: str, tmp_path: Path) -> None:
    compiler = shutil.which("c++")
    if compiler is None:
        pytest.skip("needs a C++ compiler, c++")
    write_sources(sources_of(load_scene(*THESIS)), tmp_path, "--out")
    (tmp_path / "main.cpp").write_text(
        '#include "drive.h"\nint main() { struct drive d; drive_init(&d); '
        "return drive_step(&d, 1) == DRIVE_OK && DRIVE_STEP > 0 ? 0 : 1; }\n"
    )
    words = [compiler, f"-std={standard}", "-Wall", "-Wextra", "-Werror", "-c", "main.cpp"]
    made = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True)
    assert made.returncode == 0, made.stderr


@needs_compiler
@pytest.mark.skipif(platform.machine() != "x86_64", reason="flags of x86-64")
@pytest.mark.parametrize("flag, accepted", [("-mavx512fp16", True), ("-mfpmath=387", False)])
def test_doubles_must_be_computed_as_such(flag: str, accepted: bool, tmp_path: Path) -> None:
    """With half-precision instructions, `FLT_EVAL_METHOD` is 16, which says nothing of doubles."""
    words = ["cc", "-std=gnu99", flag, "-fsyntax-only"]
    (tmp_path / "empty.c").write_text("int nothing;\n")
    if subprocess.run([*words, "empty.c"], cwd=tmp_path, capture_output=True).returncode != 0:
        pytest.skip(f"this compiler does not know {flag}")
    write_sources(sources_of(load_scene(*THESIS)), tmp_path, "--out")
    checked = subprocess.run([*words, "drive.c"], cwd=tmp_path, capture_output=True, text=True)
    assert (checked.returncode == 0) == accepted, checked.stderr
    assert accepted or "with more digits" in checked.stderr


def test_what_it_says_to_leave_out_can_be_left_out_so() -> None:
    changes = ["effects.ball_spin="]  # then only friction uses the balls' radius
    with pytest.raises(SceneError) as raised:
        sources_of(load_scene("thesis-hold", changes))
    hint = re.findall(r"--set (\S+=)", str(raised.value))
    assert hint == ["effects.rolling_friction="]
    assert sources_of(load_scene("thesis-hold", changes + hint)).files["drive.c"]


@pytest.mark.parametrize(
    ("name", "changes", "words"),
    [
        ("thesis-hold", [], "effects: rolling_friction (balls stick and slip)"),
        ("weak-motor", [], "(--set effects.motor=)"),
        ("everything", [], "ball_contact (balls collide), motor (a motor reaches its limit)"),
        ("no-ball", ["accuracy.whirl=1e-6"], "--set accuracy= --set solver.stepper=rk8"),
        (
            *("feeding-deck", ["solver.stepper=imex8"]),
            "is imex8 here (named by the scene)",
        ),
        (
            *("nsc-case-1", ["effects.viscous_drag.coefficient=100"]),
            "--set solver.stepper=rk8 --set solver.step=1e-05",
        ),
        ("nsc-case-1", ["spindle.max_speed=1e5"], "C takes commands up to spindle.max_speed"),
        (
            "no-ball",
            ["probes.probe={}"],
            "(--set probes=)",
        ),
        (
            "adaptive-start-up",
            ["effects.rolling_friction="],
            "or leave it out (--set profile=)",
        ),
    ],
)
def test_scenes_that_c_cannot_do_are_refused(name: str, changes: list[str], words: str) -> None:
    with pytest.raises(SceneError) as raised:
        sources_of(load_scene(name, changes))
    assert words in str(raised.value)


def test_all_reasons_are_named_at_once_with_what_leaves_them_out() -> None:
    with pytest.raises(SceneError, match="2 reasons: .*rolling_friction.*profile.kind") as raised:
        sources_of(load_scene("adaptive-start-up"))
    options = str(raised.value).rpartition("without all of them: ")[2]
    changes = options.removeprefix("--set ").split(" --set ")
    assert sources_of(load_scene("adaptive-start-up", changes)).files


def test_what_a_refusal_says_to_do_helps() -> None:
    """Of a drag too stiff for the scene's step."""
    scene = load_scene("nsc-case-1", ["effects.viscous_drag.coefficient=100"])
    with pytest.raises(SceneError) as raised:
        sources_of(scene)
    changes = re.findall(r"--set (\S+)", str(raised.value))
    changed = load_scene("nsc-case-1", ["effects.viscous_drag.coefficient=100", *changes])
    assert sources_of(changed).choice.stepper.name == "rk8"


def test_a_folder_s_own_files_stay(tmp_path: Path) -> None:
    (tmp_path / "main.c").write_text("int main(void) { return 0; }\n")
    done = ab_sim("c", "no-ball", "--out", str(tmp_path), cwd=tmp_path)
    assert done.returncode == 2 and "has a main.c that" in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["main.c"]


def test_files_of_ours_are_replaced(tmp_path: Path) -> None:
    (tmp_path / "mine.c").write_text("\n")
    for name in ("no-ball", "nsc-case-1"):
        write_sources(sources_of(load_scene(name)), tmp_path, "--out")
        assert name in (tmp_path / "drive.h").read_text()
    assert {path.name for path in tmp_path.iterdir()} == {*NAMES, "mine.c"}


def test_a_disk_that_is_full_leaves_what_was_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_sources(sources_of(load_scene("no-ball")), tmp_path, "--out")
    before = {path.name: path.read_text() for path in tmp_path.iterdir()}
    whole, count = Path.write_text, iter(range(100))

    def full(self: Path, *given: Any, **more: Any) -> int:
        if next(count) == 3:
            raise OSError(errno.ENOSPC, "No space left on device")
        return whole(self, *given, **more)

    other = sources_of(load_scene("nsc-case-1"))
    monkeypatch.setattr(Path, "write_text", full)
    with pytest.raises(InputError, match="No space left"):
        write_sources(other, tmp_path, "--out")
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == before


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((), "nothing to write: name a folder with --out, or an FMU with --fmu"),
        (("--fmu", "drive.zip"), "--fmu drive.zip: must end in .fmu"),
        (("--fmu", "no/drive.fmu"), "there is no folder no"),
        (("--out", "file/drive"), "file is not a folder"),
        (("--set", "balls.mas=1", "--out", "o"), "did you mean"),
    ],
)
def test_bad_input_is_one_line(arguments: tuple[str, ...], words: str, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    error = refused("c", "no-ball", *arguments, cwd=tmp_path)
    assert words in error and "\n" not in error
