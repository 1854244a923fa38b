"""Natural frequencies of the long rotor: the papers', and ours without their approximation."""

from ab_sim.analysis.modes import moving, vibration_of
from gallery.page import PageSection, Table
from gallery.two_plane.long_rotor import bearings, long_rotor
from gallery.two_plane.rotor import SPARE, Bearing, RigidRotor, scene_of

CASES: tuple[tuple[str, tuple[Bearing, ...], tuple[float, ...]], ...] = (
    ("midspan, isotropic: (18)", bearings(), (1.0, 1.81)),
    ("off midspan: ENOC (6)", bearings((9.0, -3.0)), (0.89, 4.07)),
    ("5 times as stiff along Y: ENOC (7)", bearings(across=5.0), (1.0, 1.81, 2.24, 4.05)),
)
"""Of each its bearings, and the printed critical speeds [Omega_1]."""
ACROSS = {"X", "Y", "tilt about x", "tilt about y"}
"""Coordinates that the papers have."""


def critical_speeds(p: RigidRotor, highest: float) -> list[float]:
    """Those that unbalance excites: of forward whirl, or of any between unequal stiffnesses.

    Parameters
    ----------
    p
        The rotor; its balls do not matter.
    highest
        Speed to look up to [rad/s].
    """
    found = vibration_of(scene_of(p, highest / SPARE, ()))
    unequal = any(b.stiffness[0] != b.stiffness[1] for b in p.bearings)
    return [
        speed
        for speed, mode in found.over_speed.critical
        if ACROSS & {*moving(found.linearised, mode)} and (unequal or mode.sense == "forward")
    ]


def frequency_section() -> PageSection:
    """The printed critical speeds beside ours."""
    rows = []
    for title, bearing, printed in CASES:
        found = critical_speeds(long_rotor(bearings=bearing), 10.0)
        rows += [(title, a, b) for a, b in zip(printed, found, strict=True)]
    text = (
        "Without balls. In the last case the bearings' stiffness differs by axis, so the whirl "
        "is not circular: the conical speeds solve (9 - Jt w^2)(45 - Jt w^2) = Jp^2 w^4 and "
        "are 8 and 7 % lower than printed. The printed values hold for circular whirl, "
        "sqrt(k22/(Jt - Jp)).",
    )
    table = Table("Critical speeds [Omega_1]", ("bearings", "printed", "ours"), tuple(rows), 5)
    return PageSection("Natural frequencies of the long rotor", text, (table,))
