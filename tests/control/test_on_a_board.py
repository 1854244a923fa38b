"""``adaptive.c`` on an emulated Cortex-M4 gives the commands of the native build."""

import math
import shutil
import subprocess
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest

from ab_sim.control import StartUp, State
from tests.control.course import Course, Sample, settings
from tests.control.in_c import FLAGS, PICOLIBC, SOURCE

REPLAY = Path(__file__).parent / "replay.c"
BOARD = (
    "arm-none-eabi-gcc -mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16 "
    "--specs=picolibc.specs --crt0=hosted --oslib=semihost -Wl,--defsym=__flash=0 "
    "-Wl,--defsym=__flash_size=0x400000 -Wl,--defsym=__ram=0x20000000 "
    "-Wl,--defsym=__ram_size=0x400000"
).split()
QEMU = (
    "qemu-system-arm -M mps2-an386 -nographic -monitor none -serial none "
    "-semihosting-config enable=on,target=native -kernel"
).split()


@pytest.fixture(scope="module")
def samples(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of ``samples.h``: two seconds of a drive that another start-up leads."""
    recorded: list[Sample] = []

    def record(sample: Sample) -> Iterable[Sample]:
        recorded.append(sample)
        yield sample

    wanted = settings()
    course = Course(wanted, record)
    course.on(2.0, StartUp(wanted))
    rows = [(time, angle % math.tau, speed, x) for time, angle, speed, x, _ in recorded]
    assert len(rows) == 2000
    folder = tmp_path_factory.mktemp("samples")
    text = ",\n".join("{" + ", ".join(map(repr, row)) + "}" for row in rows)
    (folder / "samples.h").write_text(
        f"enum {{ PER_PERIOD = 5 }};\nstatic const double SAMPLES[][4] = {{\n{text}}};\n"
    )
    return folder


def replayed(samples: Path, real: str, compiler: list[str], run: list[str]) -> np.ndarray:
    """Return state and command of each period."""
    program = str(samples / f"{compiler[0]}-{real}")
    options = [*FLAGS, f"-DADAPTIVE_REAL={real}", f"-I{SOURCE.parent}", f"-I{samples}"]
    subprocess.run(
        [*compiler, *options, "-o", program, str(REPLAY), str(SOURCE), "-lm"], check=True
    )
    # Semihosting writes to standard error.
    ended = subprocess.run(
        [*run, program], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=120
    )
    assert ended.returncode == 0, ended.stdout
    return np.array([line.split() for line in ended.stdout.splitlines()], float)


@pytest.mark.parametrize("real, tolerance", [("double", 1e-6), ("float", 1e-2)])
def test_the_board_commands_the_same(samples: Path, real: str, tolerance: float) -> None:
    """The mathematical functions of its library may differ in the last bit."""
    for needed in (BOARD[0], QEMU[0]):
        if shutil.which(needed) is None:
            pytest.skip(f"no {needed}")
    if not PICOLIBC.exists():
        pytest.skip("no picolibc")
    native = replayed(samples, real, ["cc"], [])
    board = replayed(samples, real, BOARD, QEMU)
    assert board.shape == native.shape and len(native) > 400
    np.testing.assert_array_equal(board[:, 0], native[:, 0])
    np.testing.assert_allclose(board[:, 1], native[:, 1], rtol=0.0, atol=tolerance)
    # It dwelt, and it noticed that samples had ended.
    assert {State.RUN_UP, State.DWELL, State.ABORTING, State.ABORTED} <= set(native[:, 0])
    assert native[-1, 1] == 0.0
