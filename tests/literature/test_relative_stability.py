"""The NSC report's Table 3: settling time and maximum amplitude after a speed change.

Source: relative-stability, Table 1 (rotor), (25) (speed), section 5.1 (definitions), Table 3.
Mapping: whirl in mm; settling time from the instant of the largest whirl after the change to
the last at which it is more than 1e-6 mm away from its final value.
One ball has the two balls' mass together.

Tolerances: *computed* (EQUATIONS.md section 3) to 0.1 %, settling times to 2 ms besides (they are
read off a tail that decays into a 1e-6 mm band); *published* to the digits printed, but for
settling times, whose printed values differ from ours by up to 4 ms.
"""

import numpy as np
import pytest

from ab_sim.drive import Drive
from ab_sim.scene import load_scene

CHANGE = 10.0
BAND = 1e-6


@pytest.mark.parametrize(
    ("case", "balls", "settling", "amplitude", "published"),
    [
        (1, 1, 1.0914, 1.0780e-2, (1.092, 1.078e-2)),
        (1, 2, 2.0296, 7.5224e-3, (2.033, 7.523e-3)),
        (2, 1, 1.2862, 1.0350e-2, (1.289, 1.035e-2)),
        (2, 2, 2.4530, 6.0342e-3, (2.456, 6.034e-3)),
        (3, 1, 0.9338, 1.1990e-2, (0.934, 1.199e-2)),
        (3, 2, 7.0678, 6.6380e-3, (7.071, 6.638e-3)),
    ],
)
def test_table_3(
    case: int, balls: int, settling: float, amplitude: float, published: tuple[float, float]
) -> None:
    name = f"nsc-case-{case}"
    changes = []
    if balls == 1:
        mass = load_scene(name).balls.total_mass
        changes = ["balls.count=1", f"balls.mass={mass!r}", "start.ball_angles=[3.1]"]
    drive = Drive(load_scene(name, changes))
    drive.advance(round(CHANGE / drive.step))
    after = drive.advance(round(20.0 / drive.step))
    whirl = 1e3 * after.whirl
    top = int(np.argmax(whirl))
    away = np.flatnonzero(np.abs(whirl - whirl[-1]) > BAND)
    settled = after["time"][away[-1]] - after["time"][top]
    assert whirl[top] == pytest.approx(amplitude, rel=1e-3)
    assert settled == pytest.approx(settling, rel=1e-3, abs=2e-3)
    assert whirl[top] == pytest.approx(published[1], rel=1e-3)
    assert settled == pytest.approx(published[0], abs=4e-3)
