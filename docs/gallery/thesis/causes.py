"""What chapter 4 gives as causes: that the balls' ways are "a result" of the driving forces."""

from collections.abc import Sequence

import numpy as np

from gallery.thesis.claims import ABOUT, BALANCED, Claim, degrees, opposite
from gallery.thesis.drive import THESIS, StartUp

BOTH_MEAN = "with the mean of both forces on each"


def moved(run: StartUp, since: float = 0.0, until: float = np.inf) -> np.ndarray:
    """How far each ball goes towards falling angles between two times [s]: [deg]."""
    time = run.trajectory["time"]
    angles = np.degrees(run.trajectory.ball_angles[(time >= since) & (time <= until)])
    return np.asarray(angles[0] - angles[-1])


def by_force(run: StartUp, since: float = 0.0, until: float = np.inf) -> np.ndarray:
    """How far its driving force alone moves each ball against the drag between two times: [deg].

    That is the force's integral over time, over c_b R: what remains of the equation of motion
    where a ball is at rest on the race at both times.
    """
    time, p = run.trajectory["time"], run.parameters
    kept = (time >= since) & (time <= until)
    return np.degrees(np.trapezoid(run.forces[kept], time[kept], axis=0) / (p.c_b * p.R))


def with_mean_force(run: StartUp) -> np.ndarray:
    """Where the balls would end if each had the mean of both forces, all along [deg]."""
    own = by_force(run)
    return np.asarray(run.angles + own - own.mean())


def parted_claim(figure: str, run: StartUp) -> Claim:
    """That one ball is opposite and the other not because the forces differ (4.3, 4.5)."""
    even = with_mean_force(run)
    one, one_then = (int(opposite(angles).sum()) == 1 for angles in (run.angles, even))
    start = run.parameters.starts
    apart = [f"{abs(np.diff(angles)[0]):.0f}" for angles in (start, run.angles, even)]
    why = (
        "with equal forces one ball would also be there, because the balls start at different "
        "places" if one
        else f"the forces separate the balls, from {apart[0]} to {apart[1]} deg ({apart[2]} with "
        "the mean), but bring neither there"
    )  # fmt: skip
    return Claim(
        f"{figure} (b), (c)", "because the forces differ, one ball is there and one is not",
        f"{degrees(run.angles)}; {BOTH_MEAN} {degrees(even)} (ours: so with their own forces "
        "alone)", one and not one_then, why,
    )  # fmt: skip


def necessary_claim() -> Claim:
    """That balls have to be at -180 deg to cancel the unbalance (4.1)."""
    left, needed = abs(1.0 - THESIS.carried), np.degrees(np.arccos(-1.0 / THESIS.carried))
    return Claim(
        "4.1 (c)", "to cancel the unbalance the balls must be at -180 deg",
        f"both there leave {left:.2f} of the disc's unbalance, at +-{needed:.1f} deg they leave "
        f"none (ours: {BALANCED:g} at most there)", left <= BALANCED,
        "true only if 2 m R is M0 e; heavier balls must lie on both sides of it",
    )  # fmt: skip


def remains_claim(runs: Sequence[StartUp]) -> Claim:
    """That unbalance is left because not both balls are opposite (4.2, 4.4, 4.6)."""
    there, left = abs(1.0 - THESIS.carried), [run.residual for run in runs]
    return Claim(
        "4.2, 4.4, 4.6", "unbalance remains because not both balls are opposite",
        f"{', '.join(f'{x:.2f}' for x in left)} of the disc's unbalance, {there:.2f} if both were "
        f"(ours: {BALANCED:g} at most then)", there <= BALANCED,
        f"2 m R is {THESIS.carried:.2f} M0 e: with both there, as much would remain",
    )  # fmt: skip


def joined_claim(run: StartUp) -> Claim:
    """That both balls are opposite because the forces differ first, and are equal then (4.9)."""
    even, way, force = with_mean_force(run), moved(run, 3.0), by_force(run, 3.0)
    apart = [abs(float(x)) for x in (np.diff(run.parameters.starts)[0],
             np.diff(run.angles + way)[0])]  # fmt: skip
    return Claim(
        "4.9 (b), (c)", "as a result of forces that differ, then are equal, both balls are there",
        f"the forces bring them from {apart[0]:.0f} to {apart[1]:.0f} deg apart until 3 s, and "
        f"move them by {_and(force)} deg of {_and(way)} then; {BOTH_MEAN} they end at "
        f"{degrees(even)} (ours: there with their own forces alone, alike to {ABOUT:.0%} from 3 s "
        "on)",
        bool(opposite(run.angles).all()) and not opposite(even).all() and _alike(force)
        and _alike(way),
    )  # fmt: skip


def alike_claim(run: StartUp, hold: StartUp) -> Claim:
    """That both balls are opposite, with like ways, because the forces are like and larger (4.11).

    Parameters
    ----------
    run
        Figure 4.11.
    hold
        Figure 4.7.
    """
    way, force, other = moved(run, 2.5), by_force(run, 2.5), by_force(hold, 2.5)
    return Claim(
        "4.11 (b), (c)", "as a result of like, larger forces both are there, with like movement",
        f"from 2.5 s on the forces move them by {_and(force)} deg of {_and(way)}, in 4.7 by "
        f"{other.mean():.0f} (ours: more, alike to {ABOUT:.0%}, and of the way to {ABOUT:.0%})",
        bool(opposite(run.angles).all()) and _alike(force) and _alike(way)
        and bool(force.min() > other.max()) and _makes(force, way),
    )  # fmt: skip


def sooner_claim(half: StartUp, hold: StartUp) -> Claim:
    """That the balls are opposite sooner because the force is not dispersed (4.15)."""
    until = half.parameters.critical_time + (half.settling or np.inf)
    ways = [moved(run, 2.5, until).mean() for run in (half, hold)]
    forces = [by_force(run, 2.5, until).mean() for run in (half, hold)]
    return Claim(
        "4.15 (b), (c)", "as a result of one smooth hump they are there sooner",
        f"until {until:.2f} s, when they are, the force moves them by {forces[0]:.0f} deg of "
        f"{ways[0]:.0f}, in 4.7 by {forces[1]:.0f} of {ways[1]:.0f} (ours: {ABOUT:.0%} more, and "
        f"of the way to {ABOUT:.0%})",
        half.settling is not None and bool(forces[0] > (1.0 + ABOUT) * forces[1])
        and _makes(np.array(forces), np.array(ways)),
    )  # fmt: skip


def farther_claim(
    figure: str, printed: str, run: StartUp, beside: tuple[str, StartUp], more: bool = True
) -> Claim:
    """That the balls go farther because the force is larger (4.30, 4.40), or less far (4.27)."""
    number, other = beside
    ways, forces = ([of(x).mean() for x in (run, other)] for of in (moved, by_force))
    return Claim(
        figure, printed,
        f"the force moves them by {forces[0]:.0f} deg of {ways[0]:.0f}, in {number} by "
        f"{forces[1]:.0f} of {ways[1]:.0f} (ours: {ABOUT:.0%} {'more' if more else 'less'}, and "
        f"of the way to {ABOUT:.0%})",
        bool(forces[0] > (1.0 + ABOUT) * forces[1] if more
             else forces[0] < (1.0 - ABOUT) * forces[1])
        and _makes(np.array(forces), np.array(ways)),
    )  # fmt: skip


def force_by_whirl_claim(figure: str, printed: str, force: float, whirl: float) -> Claim:
    """That the force changes as a result of the whirl, not W/e (4.26, 4.29, 4.36).

    Parameters
    ----------
    figure
        Of the thesis.
    printed
        What it says.
    force
        Ratio of the largest forces.
    whirl
        Ratio of the largest whirls [m].
    """
    return Claim(
        figure, printed,
        f"{force:.2f} times the force, {whirl:.2f} times the whirl (ours: alike to {ABOUT:.0%})",
        bool(abs(force / whirl - 1.0) <= ABOUT),
        f"the rest, {force / whirl:.2f} times, is mostly the speed squared",
    )  # fmt: skip


def _alike(values: np.ndarray) -> bool:
    return bool(values.max() <= (1.0 + ABOUT) * values.min())


def _makes(force: np.ndarray, way: np.ndarray) -> bool:
    """Whether the ways are those by the force."""
    return bool((np.abs(force - way) <= ABOUT * way).all())


def _and(values: np.ndarray) -> str:
    return " and ".join(f"{value:.0f}" for value in values)
