"""Section 4.3: with a period of lower acceleration."""

import numpy as np
from scipy.signal import find_peaks

from gallery.thesis.causes import by_force, moved, sooner_claim
from gallery.thesis.claims import ABOUT, READ, TIMED, Claim, degrees, value
from gallery.thesis.drive import THESIS, Period, StartUp, start_ups
from gallery.thesis.matched import balance_claim, both_claim
from gallery.thesis.measures import at_time, pushed
from gallery.thesis.without_period import SOON

SLOWER = "4.15, 4.16, 4.17"
"""Figures of a half, a quarter and three quarters of the acceleration."""
QUARTER = 0.25
"""Share of a rise that what "hardly changes" explains at most; ours."""
ACCELERATIONS = (-20.0, -10.0, 0.0, 5.0, 10.0, 20.0, 30.0, 40.0)
"""In the period [rad/s^2]."""


def acceleration_claims(runs: dict[str, StartUp]) -> list[Claim]:
    """What section 4.3 states."""
    return [*_half_claims(runs), *_slower_claims(runs), _braked_claim(runs), _inhibited(runs)]


def _half_claims(runs: dict[str, StartUp]) -> list[Claim]:
    """Figure 4.15."""
    hold, half = runs["4.7"], runs["4.15"]
    humps = _humps(hold), _humps(half)
    rising = half.forward[2500 : int(np.argmax(half.forward)) + 1]
    return [
        Claim(
            "4.15 (a)", "peak W/e almost that of 4.7",
            f"{half.peak[0]:.1f}, in 4.7 {hold.peak[0]:.1f} (ours: to {ABOUT:.0%})",
            abs(half.peak[0] / hold.peak[0] - 1) < ABOUT,
        ),
        value("4.15 (a)", "time of the peak, earlier than in 4.7", 3.0, half.peak[1], " s", TIMED),
        Claim(
            "4.15 (b)", "one hump in place of the twin hump of 4.7 (b)",
            f"{humps[1]} maximum, in 4.7 {humps[0]}", humps == (2, 1),
        ),
        Claim(
            "4.15 (b)", "the force rises continuously and smoothly from 2.5 s on",
            f"from {rising[0]:.3f} to {rising[-1]:.3f} N, "
            + ("without ever falling" if np.all(np.diff(rising) >= 0.0) else "with dips"),
            bool(np.all(np.diff(rising) >= 0.0)),
        ),
        value("4.15 (b)", "time of the largest force", 3.0, half.forward_peak[1], " s", TIMED),
        Claim(
            "4.15 (c)", "the balls reach -180 deg sooner than in 4.7",
            f"{_settled(half)}; in 4.7 {_settled(hold)}",
            half.settling is not None and hold.settling is not None
            and half.settling < hold.settling,
        ),
        sooner_claim(half, hold),
        both_claim("4.15 (c), as 4.8", half),
        balance_claim("4.15, as 4.8", half, runs["4.1"]),
    ]  # fmt: skip


def _slower_claims(runs: dict[str, StartUp]) -> list[Claim]:
    """Figures 4.15 to 4.17, and other accelerations."""
    slower = [runs[number] for number in ("4.16", "4.15", "4.17")]
    swept = start_ups([(THESIS, Period(acceleration=value)) for value in ACCELERATIONS])
    reach = [float(run.angles.mean()) for run in swept]
    went = [float(run.angles.mean()) for run in slower]
    forces = [run.forward_peak[0] for run in slower]
    times = [run.forward_peak[1] for run in slower]
    from_hold = [end for at, end in zip(ACCELERATIONS, reach, strict=True) if at >= 0.0]
    return [
        Claim(
            f"{SLOWER} (c)",
            "the smaller the acceleration in the period, the farther the balls go",
            f"at 10, 20, 30 rad/s^2: {', '.join(f'{end:.0f}' for end in went)} deg at 5 s",
            bool(np.all(np.diff(went) > 0)),
        ),
        Claim(
            "section 4.3", "the acceleration in the period controls how far the balls go",
            f"at {', '.join(f'{value:g}' for value in ACCELERATIONS)} rad/s^2: "
            f"{', '.join(f'{end:.0f}' for end in reach)} deg at 5 s (ours: one way from 0 to 40 "
            f"but for {READ:g} deg)",
            bool(np.all(np.diff(from_hold) > -READ)) and from_hold[-1] - from_hold[0] > READ,
            "one end has two accelerations",
        ),
        Claim(
            f"{SLOWER} (b)", "the largest force hardly changes ...",
            ", ".join(f"{force:.4f}" for force in forces) + " N at 10, 20, 30 rad/s^2: by "
            f"{max(forces) / min(forces) - 1:.0%} (ours: to {ABOUT:.0%})",
            max(forces) / min(forces) - 1 <= ABOUT,
        ),
        Claim(
            f"{SLOWER} (b)", "... but comes later where the acceleration is small",
            ", ".join(f"{time:.2f}" for time in times) + " s at 10, 20, 30 rad/s^2",
            bool(np.all(np.diff(times) < 0)),
        ),
        _why_farther(slower),
        _encouraged(slower, runs["4.1"]),
    ]  # fmt: skip


def _braked_claim(runs: dict[str, StartUp]) -> Claim:
    """Figure 4.18."""
    hold, braked = runs["4.7"], runs["4.18"]
    return Claim(
        "4.18", "deceleration inhibits whirl, force and the balls' movement",
        f"peak W/e {braked.peak[0]:.1f}, force {braked.forward_peak[0]:.4f} N, "
        f"{degrees(braked.angles)} at 5 s; in 4.7 {hold.peak[0]:.1f}, "
        f"{hold.forward_peak[0]:.4f} N, {degrees(hold.angles)}; less than in 4.1, too",
        all(
            braked.peak[0] < one.peak[0] and braked.forward_peak[0] < one.forward_peak[0]
            and bool(np.all(braked.angles > one.angles)) for one in (hold, runs["4.1"])
        ),
    )  # fmt: skip


def _inhibited(runs: dict[str, StartUp]) -> Claim:
    """That the balls' movement is inhibited because whirl and force are small (4.18)."""
    braked = runs["4.18"]
    beside = {number: runs[number] for number in ("4.18", "4.1", "4.7")}
    forces = [float(by_force(run).mean()) for run in beside.values()]
    ways = [float(moved(run).mean()) for run in beside.values()]
    time, force = braked.trajectory["time"], braked.forces.mean(axis=1)
    held = (time >= 2.5) & (time <= 3.25)
    least = int(np.argmin(np.where(held, force, np.inf)))
    back = np.degrees(braked.trajectory.ball_angles[held].mean(axis=1))
    words = ", ".join(f"{f:.0f} deg of {w:.0f} in {number}" for number, f, w in
                      zip(beside, forces, ways, strict=True))  # fmt: skip
    return Claim(
        "4.18", "whirl and force become small, so the movement of the balls is inhibited",
        f"the force moves them by {words} (ours: {ABOUT:.0%} less than in both, and of the way to "
        f"{ABOUT:.0%}); it not only is small, it turns: {force[least]:.3f} N at {time[least]:.1f} "
        f"s, which drives them back from {back.min():.0f} to "
        f"{back[int(np.argmin(back)):].max():.0f} deg",
        forces[0] <= (1.0 - ABOUT) * min(forces[1:])
        and all(abs(f - w) <= ABOUT * w for f, w in zip(forces, ways, strict=True)),
    )  # fmt: skip


def _why_farther(slower: list[StartUp]) -> Claim:
    """That the balls go farther because the force peaks later, not because it is larger.

    A ball that drag holds goes as far as the force's integral over time, over c_b R. Of two runs'
    ratio of integrals the ratio of peaks is one part, that of how long they last the other.
    """
    far, near = slower[0], slower[-1]
    more = pushed(far) / pushed(near)
    size = float(np.log(far.forward_peak[0] / near.forward_peak[0]) / np.log(more))
    return Claim(
        SLOWER, "they go farther because the force comes later, not because it is larger",
        f"its integral over time, which moves them, is {more - 1:.0%} more at 10 than at 30 "
        f"rad/s^2: {size:.0%} of that by its size, the rest by how long it lasts (ours: by its "
        f"size {QUARTER:.0%} at most)", size <= QUARTER,
        f"its size explains {size:.0%}",
    )  # fmt: skip


def _encouraged(slower: list[StartUp], without: StartUp) -> Claim:
    """That a later force moves the balls farther right after the critical speed."""
    went = [
        float(np.degrees(at_time(run.trajectory.ball_angles, run, 2.5 + SOON)).mean())
        for run in (*slower, without)
    ]
    return Claim(
        SLOWER, "therefore, being later, it encourages the balls to move immediately after the "
        "critical speed",
        f"{SOON:g} s after it they are at " + ", ".join(f"{angle:.0f}" for angle in went[:-1])
        + f" deg at 10, 20, 30 rad/s^2, in 4.1 at {went[-1]:.0f} deg (ours: farther the later the "
        f"force, by {READ:g} deg from 30 to 10 rad/s^2)",
        bool(np.all(np.diff(went[:-1]) > 0.0)) and went[0] <= went[2] - READ,
        "all go farther than without a period, but those with a later force are behind at that "
        "time, and ahead only at the end",
    )  # fmt: skip


def _settled(run: StartUp) -> str:
    took = run.settling
    return "never at -180 deg" if took is None else f"{took:.2f} s from the period's start"


def _humps(run: StartUp) -> int:
    """Maxima of the forward force."""
    force = run.forward
    return len(find_peaks(force, prominence=0.02 * force.max())[0])
