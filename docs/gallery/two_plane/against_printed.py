"""Our rigid body beside the papers' own equations, integrated by SciPy."""

import numpy as np

from ab_sim.analysis import run_scene
from gallery.page import PageSection, Table
from gallery.two_plane.long_rotor import DYNAMIC, MEASURED_AT, OPPOSITE, long_rotor, long_scene
from gallery.two_plane.printed import printed_run
from gallery.two_plane.rotor import displacement

SCALES = (1e-1, 1e-2, 1e-3)
"""Of unbalance and ball mass."""
SPEED, DURATION = 3.5, 12.0


def difference(scale: float, starts: tuple[float, ...]) -> float:
    """Largest between the two, by the largest displacement.

    Parameters
    ----------
    scale
        Of the dynamic unbalance, and of balls of m = .005.
    starts
        The balls' alpha; empty without balls.
    """
    small = {key: scale * DYNAMIC[key] for key in ("eccentricity", "misalignment")}
    p = long_rotor(**{**DYNAMIC, **small}, ball_mass=0.005 * scale)
    run = run_scene(long_scene(p, SPEED, DURATION, starts)).trajectory
    printed = printed_run(p, SPEED, starts, run["time"])
    apart, size = (
        max(float(np.abs(each).max()) for each in found)
        for found in (
            [displacement(run, h) - printed.displacement(h) for h in MEASURED_AT],
            [printed.displacement(h) for h in MEASURED_AT],
        )
    )
    return apart / size


def check_section() -> PageSection:
    """How the difference falls with the unbalance."""
    rows = [(scale, difference(scale, ()), difference(scale, OPPOSITE)) for scale in SCALES]
    names = "unbalance and ball mass, of figure 12's", "without balls", "with balls"
    table = Table("Largest difference, of the largest displacement", names, tuple(rows), 2)
    text = (
        "The papers' equations are linear in the deck's motion. Here (1) and (2) of 2010 are "
        f"integrated by SciPy's DOP853 from rest to t = {DURATION:g} at Omega = {SPEED:g}. The "
        "difference falls with the square of the unbalance without balls, and with the ball "
        "mass with balls: both models agree in the limit.",
    )
    return PageSection("Beside the papers' own equations", text, (table,))
