"""``adaptive.c`` beside the Python class, step by step, over what a drive's sensor says."""

import ctypes
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from ab_sim.control import StartUp, StartUpSettings, State, chosen
from tests.control.course import Course, settings
from tests.control.in_c import FLAGS, PICOLIBC, SOURCE, InC, compiled

KINDS = [("displacement", 1), ("acceleration", 1), ("displacement", 2), ("acceleration", 2)]


@pytest.fixture(scope="module")
def double(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    return compiled(tmp_path_factory.mktemp("double"), "double")


@pytest.fixture(scope="module")
def single(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    return compiled(tmp_path_factory.mktemp("float"), "float")


class Compared:
    """Python and C as one controller; the numbers have to be the same in every period."""

    def __init__(self, told: StartUpSettings, library: ctypes.CDLL) -> None:
        self.python, self.c = StartUp(told), InC(library, "double", told)
        self.periods = 0

    def sample(self, *sample: float) -> None:
        self.python.sample(*sample)
        self.c.sample(*sample)

    def command(self, time: float) -> float:
        speed = self.python.command(time)
        assert self.c.command(time) == speed
        assert self.c.state_numbers() == self.python.state_numbers()
        self.periods += 1
        return speed


@pytest.mark.parametrize("quantity, axes", KINDS)
def test_same_bits(quantity: str, axes: int, double: ctypes.CDLL) -> None:
    told = settings(quantity, axes)
    both = Compared(told, double)
    Course(told).on(4.0, both)
    assert both.python.dwells and both.periods == 800


def test_same_bits_of_a_sensor_that_is_slow_and_fails(double: ctypes.CDLL) -> None:
    """Gaps, steps of the prediction in between, and an abort."""
    told = settings()
    both = Compared(told, double)
    course = Course(told, lambda sample: [sample] if round(1e3 * sample[0]) % 7 == 0 else [])
    course.on(1.0, both)
    Course(told, lambda sample: []).on(2.0, both)
    assert both.python.state is State.ABORTED and "no valid sample" in both.python.words


@pytest.mark.parametrize("fault, why", [("dies", "no valid sample"), ("is reset", "went back")])
def test_same_bits_of_a_drive_that_fails_after_the_end(
    fault: str, why: str, double: ctypes.CDLL
) -> None:
    told = settings()
    both, course = Compared(told, double), Course(told)
    while both.python.state is not State.DONE and course.drive.time < 16.0:
        course.on(0.1, both)
    assert both.python.state is State.DONE
    if fault == "is reset":
        both.sample(0.0, 0.0, 0.0, 0.0)
    for period in range(400):
        both.command(course.drive.time + told.period * period)
    assert both.python.state is State.ABORTED and why in both.python.words


def test_same_bits_of_axes_that_contradict_each_other(double: ctypes.CDLL) -> None:
    """They begin anew, and then it aborts."""
    told = settings("acceleration", axes=2)
    both = Compared(told, double)
    course = Course(told, lambda sample: [(*sample[:4], -sample[4])])
    doubted = 0.0
    while both.python.state is not State.ABORTED and course.drive.time < 8.0:
        course.on(0.1, both)
        doubted = max(doubted, both.python.observer.doubt)
    assert doubted > 0.0 and "wrong sign" in both.python.words


def test_either_goes_on_from_the_other(double: ctypes.CDLL) -> None:
    told = settings(axes=2)
    first, course = StartUp(told), Course(told)
    course.on(1.0, first)
    both = Compared(told, double)
    both.c.restore(first.state_numbers())
    both.python.restore(both.c.state_numbers())
    course.on(0.5, first, both)
    assert both.python.state_numbers() == first.state_numbers() and both.periods == 100


@pytest.mark.parametrize("quantity, axes", KINDS)
def test_single_precision_believes_the_same(quantity: str, axes: int, single: ctypes.CDLL) -> None:
    """To 0.1 % of the critical speed and 5 % of the net unbalance.

    What it decides from that may come some periods earlier or later, or differ at a limit.
    """
    told = settings(quantity, axes)
    python, c = StartUp(told), InC(single, "float", told)
    course = Course(told, lambda s: [(s[0], s[1] % 6.283185307179586, *s[2:])])
    course.on(5.0, python, c)
    other = StartUp(told)
    other.restore(c.state_numbers())
    mine, its = python.estimates, other.estimates
    assert its.critical_speed == pytest.approx(mine.critical_speed, rel=1e-3)
    assert abs(its.net_unbalance - mine.net_unbalance) < 0.05 * mine.without_balls


def test_chosen_numbers_are_the_same() -> None:
    text = SOURCE.read_text(encoding="utf-8")
    numbers = dict(re.findall(r"\b([A-Z_]+) = R?\(?([\d.e-]+)\)?", text))
    names = {name for name in vars(chosen) if name.isupper()}
    assert {name: float(numbers[name]) for name in names} == {
        name: float(getattr(chosen, name)) for name in names
    }


def test_the_texts_are_the_same(double: ctypes.CDLL) -> None:
    from ab_sim.control.observer import TEXTS, Reason

    for name in ("adaptive_reason_text", "adaptive_state_text"):
        getattr(double, name).restype = ctypes.c_char_p
    for reason in Reason:
        assert double.adaptive_reason_text(int(reason)).decode() == TEXTS.get(reason, "")
    for state in State:
        assert double.adaptive_state_text(int(state)).decode() == state.text


def test_no_allocation() -> None:
    text = Path(SOURCE).read_text(encoding="utf-8")
    assert not re.findall(r"\b(malloc|calloc|realloc|alloca|printf|stdlib)\b", text)


@pytest.mark.parametrize("real", ["double", "float"])
@pytest.mark.parametrize(
    "compiler",
    [
        "arm-none-eabi-gcc -mcpu=cortex-m4 -mthumb",
        "arm-none-eabi-gcc -mcpu=cortex-m4 -mthumb --specs=picolibc.specs",
        "clang",
    ],
)
def test_other_compilers_build_it(compiler: str, real: str, tmp_path: Path) -> None:
    """Libraries of boards: newlib has no <tgmath.h>."""
    words = compiler.split()
    if shutil.which(words[0]) is None:
        pytest.skip(f"no {words[0]}")
    if "picolibc" in compiler and not PICOLIBC.exists():
        pytest.skip("no picolibc")
    flags = [*FLAGS, "-O0", f"-DADAPTIVE_REAL={real}", "-c", "-o", str(tmp_path / "adaptive.o")]
    subprocess.run([*words, *flags, str(SOURCE)], check=True)
