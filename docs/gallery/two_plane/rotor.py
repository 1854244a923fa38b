"""The papers' rigid rotor on two bearings as a scene, and how its vibration is measured."""

import cmath
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from ab_sim import Scene, Trajectory
from ab_sim.scene.load import check_scene
from ab_sim.show.saved import save
from gallery.page import Picture

NAME = "two-plane"
TURNS = 0.99
"""Share of the mass that turns. The rest, the deck's, does not; the papers' rotor turns whole."""
HELD = 2.0
"""How many times as stiffly as its tilt the deck's turn about the shaft is held, which the papers
leave out."""
STEP = 0.05
"""That the spindle turns by in a step of integration [rad]."""
SPARE = 2.0
"""How many times as fast as it is held the spindle may be: up to there modes are looked for."""
Tell = Callable[[str, int, int], None]


class Bearing(NamedTuple):
    """A spring and a damper across the shaft, fixed to the ground."""

    height: float
    """Along the shaft from C [m]."""
    stiffness: tuple[float, float]
    """Along X and Y [N/m]."""
    damping: tuple[float, float]
    """[N s/m]."""


class RigidRotor(NamedTuple):
    """A rigid rotor with balls, in the papers' symbols."""

    mass: float
    """M, without balls [kg]."""
    transverse: float
    """J_t [kg m^2]."""
    polar: float
    """J_p [kg m^2], less than J_t."""
    radius: float
    """R of the races [m]."""
    bearings: tuple[Bearing, ...]
    eccentricity: float
    """eps [m]."""
    misalignment: float
    """chi [rad], in the direction from which angles alpha count."""
    phase: float
    """beta, of the eccentricity from there [rad]."""
    ball_mass: float
    """m [kg]."""
    planes: tuple[float, ...]
    """z of each ball [m]."""
    drag: float
    """c_b, torque on a ball per its rate [N m s]."""

    @property
    def couple(self) -> float:
        """chi (J_t - J_p) [kg m^2]."""
        return self.misalignment * (self.transverse - self.polar)


def scene_of(p: RigidRotor, speed: float, starts: tuple[float, ...], **changes: Any) -> Scene:
    """The rotor at a held speed, at rest where the bearings are relaxed.

    The package's deck moves along the shaft and turns about it as well: that is held, and hardly
    excited. The rotor has J_p about all axes, the deck J_t - J_p about those across the shaft; in
    the papers' equations only the sums count.

    Parameters
    ----------
    p
        The rotor.
    speed
        Omega [rad/s].
    starts
        The balls' alpha [rad], at rest on the race; empty without balls.
    **changes
        Of the scene's values, by key.
    """
    apart, turning = p.transverse - p.polar, TURNS * p.mass
    # Package axes begin at the unbalance.
    couple = cmath.rect(p.couple, -p.phase)
    planes = tuple(dict.fromkeys(p.planes))
    rotor = {
        "mass": p.mass,
        "eccentric_mass": turning,
        "eccentricity": p.eccentricity * p.mass / turning,
        "inertia": [*[p.polar] * 3, 0.0, -couple.real, -couple.imag],
    }
    balls: dict[str, Any] = {"count": 0}
    if starts:
        balls = {
            "count": len(p.planes),
            "mass": p.ball_mass,
            "race": [planes.index(z) for z in p.planes],
        }
    drag = p.drag / p.radius**2
    described = {
        "name": NAME,
        "rotor": rotor,
        "deck": {"inertia": [apart, apart, 0.0]},
        "mounts": _mounts(p),
        "race": {"radius": p.radius, "height": list(planes)},
        "balls": balls,
        "effects": {"viscous_drag": {"coefficient": drag}} if starts else {},
        "start": {
            "speed": speed,
            "angle": p.phase,
            **({"ball_angles": [alpha - p.phase for alpha in starts]} if starts else {}),
        },
        "spindle": {"max_speed": SPARE * speed, "max_acceleration": speed},
        "solver": {"step": 1e-9 * round(1e9 * STEP / speed)},
        "duration": 100.0 / speed,
    }
    return check_scene({**described, **changes}, "the papers' rotor")


def _mounts(p: RigidRotor) -> list[dict[str, Any]]:
    """Bearings as pairs of mounts beside the shaft; and what holds it along the shaft."""
    across = [sum(b.stiffness[way] * b.height**2 for b in p.bearings) for way in (0, 1)]
    beside = math.sqrt(HELD * max(across) / sum(b.stiffness[1] for b in p.bearings))
    pairs = [
        {
            "position": [side * beside, 0.0, b.height],
            "stiffness": [0.5 * b.stiffness[0], 0.5 * b.stiffness[1], 0.0],
            "damping": [0.5 * b.damping[0], 0.5 * b.damping[1], 0.0],
        }
        for b in p.bearings
        for side in (-1.0, 1.0)
    ]
    along = [sum(b.stiffness[0] for b in p.bearings), sum(b.damping[0] for b in p.bearings)]
    held = {
        "position": [0.0, 0.0, 0.0],
        "stiffness": [0.0, 0.0, along[0]],
        "damping": [0.0, 0.0, along[1]],
    }
    return [*pairs, held]


def alphas(p: RigidRotor, run: Trajectory) -> np.ndarray:
    """The balls' angles as the papers count them [rad], shape (samples, balls)."""
    return np.asarray(run.ball_angles + p.phase)


def balanced_alphas(p: RigidRotor) -> np.ndarray:
    """(16): where two balls in each of two planes at +-z balance, rising in each [rad]."""
    static, couple = cmath.rect(p.mass * p.eccentricity, p.phase), p.couple / p.planes[0]
    found: list[float] = []
    for need in (-(static + couple) / 2.0, -(static - couple) / 2.0):
        aside = math.acos(abs(need) / (2.0 * p.ball_mass * p.radius))
        found += [cmath.phase(need) - aside, cmath.phase(need) + aside]
    return sorted_in_planes(np.angle(np.exp(1j * np.array(found))))


def sorted_in_planes(angles: np.ndarray) -> np.ndarray:
    """Two angles in each of two planes, rising there."""
    return np.concatenate([np.sort(angles[:2]), np.sort(angles[2:])])


def shaft_at(states: np.ndarray, height: float) -> np.ndarray:
    """X + i Y of the shaft at a height from C [m], shape (samples,).

    Parameters
    ----------
    states
        X, Y and whatever; the quaternion (w, x, y, z) from the fourth column on.
    height
        [m].
    """
    w, x, y, z = states[:, 3:7].T
    lean = 2.0 * (x * z + w * y) + 2.0j * (y * z - w * x)
    return np.asarray(states[:, 0] + 1j * states[:, 1] + height * lean)


def displacement(run: Trajectory, height: float) -> np.ndarray:
    """The same over a run."""
    states = np.stack([run[key] for key in ("x", "y", "z", "qw", "qx", "qy", "qz")], axis=1)
    return shaft_at(states, height)


def vibration(run: Trajectory, heights: tuple[float, float]) -> np.ndarray:
    """A, (23): the shaft's displacement at two heights, their mean [m], shape (samples,)."""
    return np.asarray(0.5 * sum(np.abs(displacement(run, height)) for height in heights))


def written(figure: Figure, folder: Path, what: str, caption: str) -> Picture:
    """Write a picture into the folder."""
    file = f"{NAME}-{what}.png"
    save(figure, folder / file, 100)
    return Picture(file, caption)
