"""Chapter 5: balls that fall behind the rotor, and where they come to rest."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from ab_sim.papers.page import Cell, Picture, Section, Table
from ab_sim.papers.thesis.claims import OPPOSITE, Claim, degrees, table_of, value
from ab_sim.papers.thesis.drive import HOLD, THESIS, StartUp, Tell, start_ups
from ab_sim.papers.thesis.many import ends
from ab_sim.papers.thesis.pictures import SPEEDS, histories, written

PAIRS = {"5.1": (1e-3, 1.0), "5.2": (2e-3, 1.0), "5.3": (2e-3, 2.0)}
"""By figure m [kg] and c_b [N s/m]; figures 5.7 to 5.9 are the same with the hold."""
HELD = {"5.1": "5.7", "5.2": "5.8", "5.3": "5.9"}
MASSES = (0.5e-3, 1e-3, 1.5e-3, 2e-3)
"""Of a ball [kg]."""
DRAGS = np.round(np.arange(0.2, 4.01, 0.1), 3)
"""c_b of figures 5.5 and 5.11 [N s/m]; the printed axes' range is not in the text."""
ECCENTRICITIES = np.round(np.arange(50e-6, 301e-6, 10e-6), 8)
"""e of figures 5.6 and 5.12 [m], half to three times the thesis'; the printed range is not in the
text."""
MAP_MASSES = np.round(np.geomspace(0.3e-3, 4e-3, 28), 7)
MAP_DRAGS = np.round(np.geomspace(0.2, 8.0, 28), 4)
ODD = (1, 3, 5)
"""Multiples of -180 deg that are opposite to the unbalance."""


def rotation_sections(folder: Path, tell: Tell) -> tuple[Section, Section]:
    """Figures 5.1 to 5.12, and how wide the good region is."""
    tell("chapter 5", 0, 1)
    runs = histories_of()
    without = {n: runs[n] for n in PAIRS}
    held = {HELD[n]: runs[HELD[n]] for n in PAIRS}
    ends_drag, ends_e = over_drag(tell), over_eccentricity(tell)
    good = region(tell)
    first = Section(
        "5.1 Non-synchronous motion without a period: figures 5.1 to 5.6",
        (),
        (table_of("Without a variable-speed period", without_claims(runs, ends_drag, ends_e)),),
        (
            histories(folder, "5.1", without, SPEEDS, "Figures 5.1 to 5.3"),
            _ends_picture(folder, "5.4", 0, ends_drag, ends_e),
        ),
    )
    second = Section(
        "5.2 Non-synchronous motion with a period: figures 5.7 to 5.12, and how wide it is good",
        (
            "The thesis leaves open how carefully m and c_b must be matched. The map shows it: "
            "where both balls are within 30 deg of an odd multiple of -180 deg 2.5 s after the "
            "critical speed, without and with the hold of 0.5 s.",
        ),
        (
            table_of("With a hold of 0.5 s", hold_claims(runs, ends_drag, ends_e)),
            _width_table(good),
        ),
        (
            histories(folder, "5.7", held, SPEEDS, "Figures 5.7 to 5.9"),
            _ends_picture(folder, "5.10", 1, ends_drag, ends_e),
            _map_picture(folder, good),
        ),
    )
    return first, second


def histories_of() -> dict[str, StartUp]:
    """By figure the runs of 5.1 to 5.3 and 5.7 to 5.9."""
    drives = {number: THESIS._replace(m=m, c_b=c_b) for number, (m, c_b) in PAIRS.items()}
    numbers = [*drives, *HELD.values()]
    cases = [(p, None) for p in drives.values()] + [(p, HOLD) for p in drives.values()]
    return dict(zip(numbers, start_ups(cases), strict=True))


Ends = dict[float, tuple[np.ndarray, np.ndarray]]
"""By a ball's mass the end positions without and with the hold [deg]."""


def over_drag(tell: Tell) -> Ends:
    """Figures 5.5 and 5.11."""
    return _ends(tell, "figures 5.5 and 5.11", [{"c_b": float(c_b)} for c_b in DRAGS])


def over_eccentricity(tell: Tell) -> Ends:
    """Figures 5.6 and 5.12."""
    return _ends(tell, "figures 5.6 and 5.12", [{"e": float(e)} for e in ECCENTRICITIES])


def region(tell: Tell) -> np.ndarray:
    """Ends over m and c_b [deg], shape (without or with the hold, masses, drags)."""
    drives = [THESIS._replace(m=float(m), c_b=float(c_b)) for m in MAP_MASSES for c_b in MAP_DRAGS]
    cases = [(p, None) for p in drives] + [(p, HOLD) for p in drives]
    found = ends("map of m and c_b", cases, tell)
    return np.array([end.angle for end in found]).reshape(2, len(MAP_MASSES), len(MAP_DRAGS))


def at_odd(ends: np.ndarray) -> np.ndarray:
    """Whether positions [deg] are within 30 deg of an odd multiple of -180 deg."""
    return np.any([np.abs(ends + 180.0 * odd) <= OPPOSITE for odd in ODD], axis=0)


def without_claims(runs: dict[str, StartUp], drag: Ends, eccentricity: Ends) -> list[Claim]:
    """What section 5.1 states."""
    one, heavy, braked = (runs[number] for number in PAIRS)
    lags = [_lag(run) for run in (one, heavy, braked)]
    masses = [drag[m][0][_drag_at(1.0)] for m in MASSES]
    beyond = float(start_ups([(THESIS._replace(m=3e-3), None)])[0].angles.mean())
    settled = [_settled_after(run) for run in (one, heavy, braked)]
    return [
        Claim("5.1 (b), 5.2 (b)", "above the critical speed the balls lag behind the rotor",
              f"by {lags[0]:.1f} and {lags[1]:.1f} rad/s at most", lags[0] > 0 and lags[1] > 0),
        Claim("5.2 (b)", "more so with the heavier ball", f"{lags[1]:.1f}, {lags[0]:.1f} rad/s",
              lags[1] > lags[0]),
        Claim("5.1 (c)", "the balls do not exceed -180 deg", degrees(one.angles),
              bool((one.angles > -180.0).all())),
        value("5.2 (c)", "near -540 deg (section 5.2: about -600 deg)", -600.0,
              float(heavy.angles.mean()), " deg"),
        Claim("5.3 (b)", "c_b = 2 reduces the lag",
              f"{lags[2]:.1f} in place of {lags[1]:.1f} rad/s",
              lags[2] < lags[1]),
        value("5.2 (c)", "settled after the critical speed within", 1.0, settled[1], " s", 0.35),
        value("5.3 (c)", "settled after the critical speed within", 0.5, settled[2], " s", 0.35),
        value("5.3 (c)", "suppressed to", -200.0, float(braked.angles.mean()), " deg"),
        Claim("5.4", "the heavier the balls, the farther they go",
              _list(masses) + " deg for m = 0.5, 1, 1.5, 2 g", bool(np.all(np.diff(masses) < 0))),
        Claim("5.4", "beyond 2 g farther still", f"{beyond:.0f} deg for m = 3 g",
              beyond < masses[-1]),
        Claim("5.4", "they settle in the vicinity of odd multiples of -180 deg",
              _list(masses) + " deg", bool(at_odd(np.array(masses)).all()),
              "2.5 s after the critical speed the others are still on their way, or stand "
              "where drag and driving force are equal"),
        Claim("5.5", "the larger c_b, the less far", _rising_words(drag, 0), _rises(drag, 0)),
        Claim("5.5", "by c_b and m the end can be tuned to odd multiples of -180 deg",
              _tunable_words(drag, 0), all(at_odd(drag[m][0]).any() for m in MASSES)),
        Claim("5.6", "e does not change the end position much",
              _spread_words(eccentricity, 0), _steady(eccentricity, 0),
              "light balls go farther as e grows, heavy ones slip by a further turn"),
    ]  # fmt: skip


def hold_claims(runs: dict[str, StartUp], drag: Ends, eccentricity: Ends) -> list[Claim]:
    """What section 5.2 states."""
    one, heavy, braked = (runs[HELD[number]] for number in PAIRS)
    without = [runs[number] for number in PAIRS]
    during = _lag_during_hold(one), _lag_during_hold(heavy), _lag_during_hold(braked)
    lags = [_lag(run) for run in (one, heavy, braked)]
    masses = [drag[m][1][_drag_at(1.0)] for m in MASSES]
    spreads = [_spread(eccentricity, held) for held in (0, 1)]
    settled = [_settled_after(run) for run in (one, heavy, braked)]
    before = [_settled_after(run) for run in without]
    over_e = start_ups([(THESIS._replace(e=float(e)), HOLD) for e in ECCENTRICITIES[::5]])
    times = [_settled_after(run) for run in over_e]
    return [
        Claim("5.7 (c)", "about -200 deg about 1 s after the critical speed",
              f"{degrees(_angles_at(one, 3.5))} at 3.5 s, {degrees(one.angles)} at 5 s",
              bool(np.abs(_angles_at(one, 3.5) + 200.0).max() < 25.0)),
        Claim("5.8 (c)", "beyond -540 deg, heading towards -900 deg, not settled at 5 s",
              f"{degrees(heavy.angles)} at 5 s, still turning by "
              f"{np.degrees(heavy.trajectory.ball_rates[-1]).mean():.0f} deg/s",
              bool((heavy.angles < -570.0).all())),
        Claim("5.7", "settled sooner than without the period", f"after {settled[0]:.2f} s, "
              f"without {before[0]:.2f} s", settled[0] < before[0]),
        Claim("5.8", "settled later than without the period", f"after {settled[1]:.2f} s, "
              f"without {before[1]:.2f} s", settled[1] > before[1]),
        Claim("5.9", "settled in an unbalanced position", degrees(braked.angles),
              not bool(at_odd(braked.angles).any())),
        Claim("5.9", "the settling time grows by the period of 0.5 s", f"by "
              f"{settled[2] - before[2]:.2f} s", abs(settled[2] - before[2] - 0.5) < 0.15),
        value("5.9 (c)", "settled at", -300.0, float(braked.angles.mean()), " deg"),
        Claim("5.7-5.9 (b)", "in the hold the balls keep the rotor's speed",
              ", ".join(f"{lag:.1f}" for lag in during) + " rad/s behind it at most",
              max(during) < 0.05 * 100.0,
              "they move against the rotor all through the hold: that is what carries them "
              "towards -180 deg"),
        Claim("5.7-5.9 (b)", "after the hold they lag behind: the lag does not go away",
              ", ".join(f"{lag:.1f}" for lag in lags) + " rad/s", min(lags) > 1.0),
        Claim("5.2", "the lag grows with m and falls with c_b",
              ", ".join(f"{lag:.1f}" for lag in lags) + " rad/s",
              lags[1] > lags[0] and lags[2] < lags[1]),
        Claim("5.2", "the balls' movement is promoted",
              "; ".join(f"{r.angles.mean():.0f} in place of {w.angles.mean():.0f} deg"
                        for r, w in zip((one, heavy, braked), without, strict=True)),
              all(r.angles.mean() < w.angles.mean()
                  for r, w in zip((one, heavy, braked), without, strict=True))),
        Claim("5.10", "the heavier the balls, the farther they go",
              _list(masses) + " deg for m = 0.5, 1, 1.5, 2 g", bool(np.all(np.diff(masses) < 0))),
        Claim("5.10", "m = 1 g: nearly -180 deg; m = 1.5 g: an unbalanced position",
              _list(masses[1:3]) + " deg",
              bool(at_odd(np.array(masses[1]))) and not bool(at_odd(np.array(masses[2])))),
        Claim("5.11", "the larger c_b, the less far", _rising_words(drag, 1), _rises(drag, 1)),
        Claim("5.11", "by c_b and m the end can be tuned to odd multiples of -180 deg",
              _tunable_words(drag, 1), all(at_odd(drag[m][1]).any() for m in MASSES)),
        Claim("5.12", "e does not change the end position much, whatever m",
              _spread_words(eccentricity, 1), _steady(eccentricity, 1),
              "light balls go farther as e grows; of 1.5 g they slip by a turn from 200 um on"),
        Claim("5.12", "the settling time is not significantly changed by e, m = 1 g",
              f"{min(times):.2f} to {max(times):.2f} s", max(times) - min(times) < 0.3),
        Claim("5.12", "less than without the hold",
              f"spread over e, mean of four masses: {spreads[1]:.0f} deg, without {spreads[0]:.0f}",
              spreads[1] < spreads[0]),
    ]  # fmt: skip


def _lag(run: StartUp) -> float:
    """How far the mean ball falls behind the rotor at most, above the critical speed [rad/s]."""
    late = run.trajectory["time"] > run.parameters.critical_time
    return float(-run.trajectory.ball_rates[late].mean(axis=1).min())


def _lag_during_hold(run: StartUp) -> float:
    time = run.trajectory["time"]
    return float(-run.trajectory.ball_rates[(time > 2.5) & (time < 3.0)].min())


SETTLED = 25.0
"""Balls have settled when they stay this near to where they end [deg]."""


def _settled_after(run: StartUp) -> float:
    """How long after the critical speed the balls have settled [s]; 2.5 if they have not."""
    angle = np.degrees(run.trajectory.ball_angles.mean(axis=1))
    away = np.flatnonzero(np.abs(angle - angle[-1]) > SETTLED)
    last = 0 if not len(away) else int(away[-1])
    return float(run.trajectory["time"][last] - run.parameters.critical_time)


def _angles_at(run: StartUp, time: float) -> np.ndarray:
    at = int(np.argmin(np.abs(run.trajectory["time"] - time)))
    return np.degrees(run.trajectory.ball_angles[at])


def _ends(tell: Tell, what: str, changes: list[dict[str, Any]]) -> Ends:
    drives = [THESIS._replace(m=m, **change) for m in MASSES for change in changes]
    cases = [(p, None) for p in drives] + [(p, HOLD) for p in drives]
    angles = np.array([end.angle for end in ends(what, cases, tell)]).reshape(
        2, len(MASSES), len(changes)
    )
    return {m: (angles[0, k], angles[1, k]) for k, m in enumerate(MASSES)}


def _drag_at(c_b: float) -> int:
    return int(np.argmin(np.abs(DRAGS - c_b)))


def _list(values: list[float]) -> str:
    return ", ".join(f"{value:.0f}" for value in values)


def _rises(ends: Ends, held: int) -> bool:
    """Whether the balls go less far with every step of c_b, but for 5 deg."""
    return all(bool(np.all(np.diff(ends[m][held]) > -5.0)) for m in MASSES)


def _rising_words(ends: Ends, held: int) -> str:
    back = {m: float(-np.diff(ends[m][held]).min()) for m in MASSES}
    return "; ".join(
        f"{1e3 * m:g} g: {ends[m][held][0]:.0f} to {ends[m][held][-1]:.0f} deg"
        + (f", falls by up to {fall:.0f}" if fall > 5.0 else "")
        for m, fall in back.items()
    )


def _tunable_words(ends: Ends, held: int) -> str:
    words = []
    for m in MASSES:
        good = DRAGS[at_odd(ends[m][held])]
        words.append(f"{1e3 * m:g} g: {len(good)} of {len(DRAGS)} values of c_b")
    return "; ".join(words)


STEADY = 60.0
"""[deg] over all eccentricities: "not so large"."""


def _steady(ends: Ends, held: int) -> bool:
    return all(np.ptp(ends[m][held]) <= STEADY for m in MASSES)


def _spread(ends: Ends, held: int) -> float:
    return float(np.mean([np.ptp(ends[m][held]) for m in MASSES]))


def _spread_words(ends: Ends, held: int) -> str:
    return "; ".join(f"{1e3 * m:g} g: by {np.ptp(ends[m][held]):.0f} deg" for m in MASSES)


def _ends_picture(folder: Path, number: str, held: int, drag: Ends, eccentricity: Ends) -> Picture:
    """Figures 5.4 to 5.6, or 5.10 to 5.12."""
    figure = Figure(figsize=(13.0, 4.6), layout="constrained")
    time, over_drag, over_e = figure.subplots(1, 3)
    first, second, third = ("5.4", "5.5", "5.6") if held == 0 else ("5.10", "5.11", "5.12")
    drives = [(THESIS._replace(m=m), HOLD if held else None) for m in MASSES]
    for m, run in zip(MASSES, start_ups(drives), strict=True):
        label = f"{1e3 * m:g} g"
        time.plot(
            run.trajectory["time"] - 2.5, run.trajectory.ball_angles[:, 0] / -np.pi, label=label
        )
        over_drag.plot(DRAGS, drag[m][held] / -180.0, label=label)
        over_e.plot(1e6 * ECCENTRICITIES, eccentricity[m][held] / -180.0, label=label)
    time.set_xlim(0.0, 2.5)
    time.set_xlabel("time after the critical speed [s]")
    over_drag.set_xlabel("c_b [N s/m]")
    over_e.set_xlabel("e [um]")
    time.set_ylabel("ball position, times -180 deg")
    for axes, name in ((time, first), (over_drag, second), (over_e, third)):
        axes.set_title(f"Fig. {name}", fontsize=11)
        axes.grid(alpha=0.3)
        axes.legend(fontsize=8, title="m")
        for odd in ODD:
            axes.axhline(odd, color="0.6", lw=0.8, ls="--", zorder=0)
    what = "with a hold of 0.5 s" if held else "without a variable-speed period"
    caption = f"Figures {first} to {third}: {what}; dashed: opposite to the unbalance"
    return written(figure, folder, number, caption)


def _width_table(ends: np.ndarray) -> Table:
    """How wide the good stretch of c_b is, at each of some masses."""
    rows: list[tuple[Cell, ...]] = []
    for m in (0.5e-3, 1e-3, 2e-3, 4e-3):
        k = int(np.argmin(np.abs(MAP_MASSES - m)))
        cells: list[Cell] = [f"{1e3 * MAP_MASSES[k]:.2g} g"]
        for held in (0, 1):
            good = np.abs(ends[held, k] + 180.0) <= OPPOSITE
            cells.append(f"{_stretch(good)}")
        rows.append(tuple(cells))
    shares = [f"{at_odd(ends[held]).mean():.0%}" for held in (0, 1)]
    rows.append(("share of the map, any odd multiple", *shares))
    return Table(
        "c_b [N s/m] for which both balls end within 30 deg of -180 deg",
        ("m", "without a period", "hold of 0.5 s"),
        tuple(rows),
    )


def _stretch(good: np.ndarray) -> str:
    """First to last good value, and their ratio."""
    if not good.any():
        return "none"
    first, last = MAP_DRAGS[good][0], MAP_DRAGS[good][-1]
    return f"{first:.2g} to {last:.2g}, a factor of {last / first:.2g}"


def _map_picture(folder: Path, ends: np.ndarray) -> Picture:
    figure = Figure(figsize=(12.0, 5.0), layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    for axes, each, title in zip(panels, ends, ("without a period", "hold of 0.5 s"), strict=True):
        _map(figure, axes, each)
        axes.set_title(title)
        axes.set_xlabel("m [g]")
    panels[0].set_ylabel("c_b [N s/m]")
    caption = (
        "End position over m and c_b; outlined: within 30 deg of an odd multiple of -180 deg; "
        "yellow: six times and more; cross: the thesis' own set"
    )
    return written(figure, folder, "5-map", caption)


def _map(figure: Figure, axes: Axes, ends: np.ndarray) -> None:
    x = 1e3 * MAP_MASSES
    drawn = axes.pcolormesh(
        x, MAP_DRAGS, ends.T / -180.0, shading="nearest", cmap="viridis", vmin=0.0, vmax=6.0
    )
    axes.contour(x, MAP_DRAGS, at_odd(ends).T.astype(float), [0.5], colors="white", linewidths=1.2)
    axes.plot(1.0, 1.0, "x", color="tab:red", ms=9, mew=2)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xticks([0.3, 0.5, 1.0, 2.0, 4.0], ["0.3", "0.5", "1", "2", "4"], minor=False)
    axes.set_yticks([0.2, 0.5, 1.0, 2.0, 5.0], ["0.2", "0.5", "1", "2", "5"], minor=False)
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.yaxis.set_minor_formatter(NullFormatter())
    figure.colorbar(drawn, ax=axes, label="ball position, times -180 deg")
