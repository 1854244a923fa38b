"""Pictures of a run: speed, whirl, tilt, driving force and balls over time."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MultipleLocator

from ab_sim.analysis.comparison import Compared, Comparison
from ab_sim.analysis.metrics import Metrics, metrics_of
from ab_sim.analysis.rest import from_rest, rest_of
from ab_sim.analysis.startup import AdaptiveOutcome
from ab_sim.drive.closed_forms import driving_forces
from ab_sim.drive.controllers import TimedDecision
from ab_sim.drive.trajectory import Trajectory
from ab_sim.model.equations.effects import Motor
from ab_sim.scene.model import Scene
from ab_sim.show.adaptive import draw_unbalance, mark_states
from ab_sim.show.curves import draw_curve, in_degrees, write_conventions
from ab_sim.show.labels import Label, label_at_right
from ab_sim.show.saved import ResultFigure
from ab_sim.show.styles import (
    COMMANDED,
    GREEN,
    LIMIT,
    RUN,
    SERIES,
    WITHOUT_BALLS,
    WITHOUT_PERIOD,
    ball_styles,
)

_TILT = ("alpha, about x", "beta, about y", "gamma, about the shaft")
KINDS = {
    "start_up": "Start-up",
    "speed_change": "Speed change",
    "segments": "Run",
    "adaptive": "Adaptive start-up",
}
"""Titles by the profile's kind."""
_LEAST = 1e-4
"""Fraction of the peak below which whirl, height and tilt are not drawn."""


def drawn_run(
    trajectory: Trajectory,
    scene: Scene,
    comparison: Comparison,
    period_start: float | None = None,
    title: str | None = None,
    adaptive: AdaptiveOutcome | None = None,
    aborted: TimedDecision | None = None,
) -> ResultFigure:
    """Return the figure of a run.

    The panels show the speed and W/e, also of the runs for comparison. A deck in space adds height
    and tilt, a motor its torque. Balls add the driving force on them and their angles from the
    unbalance, or their speeds if they circulate.

    Parameters
    ----------
    trajectory
        Consecutive samples, from the start to the end.
    scene
        Scene of the run.
    comparison
        The same run without its variable-speed period, and without its balls.
    period_start
        Start of the variable-speed period [s], if there is one.
    title
        Title of the picture; default: the profile's kind and the scene's name.
    adaptive
        Outcome of an adaptive start-up's controller: dwells are marked, and the estimated net
        unbalance is drawn with the true one.
    aborted
        Time and reason of an abort, shown in place of the final whirl.
    """
    metrics = metrics_of(trajectory, scene)
    trajectory = from_rest(trajectory, scene)
    motor, balls = scene.effects.get("motor"), trajectory.balls
    heights = {"speed": 0.5, "whirl": 1.2}
    heights |= {} if adaptive is None else {"unbalance": 0.7}
    heights |= {"height": 0.5} if _rises(trajectory, scene) else {}
    heights |= {"tilt": 0.7} if trajectory.tilts else {}
    heights |= {} if motor is None else {"torque": 0.6}
    heights |= {"force": 0.7, "angles": 1.0} if balls else {}
    figure = ResultFigure(figsize=(10, 0.8 + 2.9 * sum(heights.values())), layout="constrained")
    panels = figure.subplots(len(heights), 1, sharex=True, height_ratios=[*heights.values()])
    at = dict(zip(heights, panels, strict=True))
    kind = "Run" if scene.profile is None else KINDS[scene.profile.kind]
    figure.suptitle(title or f"{kind} of {scene.name}", fontsize=14)
    time = trajectory["time"]
    panels[0].set_xlim(time[0], time[-1])
    panels[-1].set_xlabel("time [s]")
    for axes in panels:
        axes.grid(alpha=0.3)
    panels[0].set_title(_summary(metrics, scene, comparison, aborted), fontsize=9)
    _draw_speed(at["speed"], trajectory, scene, comparison)
    _draw_whirl(at["whirl"], trajectory, scene, metrics, comparison)
    if adaptive is not None:
        draw_unbalance(at["unbalance"], trajectory, scene, adaptive)
        mark_states(panels, adaptive)
    if "height" in at:
        _draw_height(at["height"], trajectory)
    if "tilt" in at:
        _draw_tilt(at["tilt"], trajectory, scene)
    if motor is not None:
        _draw_torque(at["torque"], trajectory, motor)
    if balls:
        _draw_forces(at["force"], trajectory, scene)
        _draw_balls(at["angles"], trajectory, scene, metrics)
    if period_start is not None and period_start < time[-1]:
        _mark_period(panels, scene, period_start)
    figure.align_ylabels(panels)
    write_conventions(figure)
    return figure


def _summary(
    metrics: Metrics, scene: Scene, comparison: Comparison, aborted: TimedDecision | None
) -> str:
    """Return a summary of the run in one line: final whirl, settling, circulation, unbalance."""
    if aborted is not None:  # there is no whirl at standstill
        return f"aborted at {aborted.time:.1f} s: {aborted.text}"
    e = scene.rotor.eccentricity
    scale, unit = (1 / e, " e") if e > 0 else (1e3, " mm")
    parts = [f"final whirl {metrics.final_whirl * scale:.3g}{unit}"]
    if (share := comparison.relative_whirl(metrics)) is not None:
        parts[0] += f", {share:.3g} times that without balls"
    if not metrics.settled:
        parts.append("still changing at the end")
    elif metrics.in_band_from is None:
        least, most = (whirl * scale for whirl in metrics.span)
        parts.append(f"between {least:.3g} and {most:.3g}{unit} at the end")
    else:
        within = f"+-{metrics.band * scale:.2g}{unit}"
        parts.append(f"stays within {within} of it from {metrics.in_band_from:.3f} s on (triangle)")
    if metrics.circulating is not None:
        parts.append(f"balls circulate: {metrics.circulating.text(scene.balls.count)}")
    if scene.balls.count and metrics.residual_unbalance is not None:
        parts.append(f"residual unbalance {metrics.residual_unbalance:.3g}")
    return "; ".join(parts)


def _draw_speed(axes: Axes, path: Trajectory, scene: Scene, comparison: Comparison) -> None:
    """Draw spindle speed, critical speed and, with a motor, the commanded speed."""
    labels = []
    if "motor" in scene.effects:
        axes.plot(path["time"], path["command"], color=COMMANDED, lw=0.8, ls="--")
        labels.append(Label(path["command"][-1], "commanded", COMMANDED))
    other = comparison.without_period
    if isinstance(other, Compared):
        axes.plot(other.time, other.speed, color=WITHOUT_PERIOD, lw=1.0, ls="--")
    axes.plot(path["time"], path["speed"], color=RUN, lw=1.5)
    labels.append(Label(path["speed"][-1], "spindle speed", RUN))
    if scene.critical_speed is not None:
        axes.axhline(scene.critical_speed, color=LIMIT, lw=0.8, ls=":")
        labels.append(Label(scene.critical_speed, "critical speed", LIMIT))
        # The opposite direction of rotation has the same critical speed.
        if path["speed"].min() <= -scene.critical_speed:
            axes.axhline(-scene.critical_speed, color=LIMIT, lw=0.8, ls=":")
            labels.append(Label(-scene.critical_speed, "critical speed", LIMIT))
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.1 * (high - low))
    axes.set_ylabel("speed [rad/s]")
    label_at_right(axes, labels)


def _draw_whirl(
    axes: Axes, path: Trajectory, scene: Scene, metrics: Metrics, comparison: Comparison
) -> None:
    """Draw the whirl of the run and of the runs for comparison, with peak and settling time."""
    e = scene.rotor.eccentricity
    scale, unit = (1 / e, "W/e [1]") if e > 0 else (1e3, "W [mm]")
    compared = [metrics]
    labels = [Label(metrics.final_whirl * scale, _final(metrics, scale, "this run"), RUN)]
    for name, other in comparison.by_name().items():
        color = WITHOUT_BALLS if other is comparison.without_balls else WITHOUT_PERIOD
        if isinstance(other, Compared):
            draw_curve(axes, other.time, other.whirl * scale, color=color, lw=0.9, zorder=2)
            compared.append(other.metrics)
            text = _final(other.metrics, scale, name.replace(" variable-", "\nvariable-"))
            labels.append(Label(other.metrics.final_whirl * scale, text, color))
    draw_curve(axes, path["time"], path.whirl * scale, color=RUN, lw=1.3, zorder=3)
    hangs = ",\nfrom where the deck hangs" if "gravity" in scene.effects else ""
    axes.set_ylabel(f"whirl radius {unit}{hangs}")
    finals = [m.final_whirl for m in compared if m.final_whirl > 0]
    peak = metrics.peak_whirl * scale
    if finals and peak > 0:
        axes.set_yscale("log")
        top = max(m.peak_whirl for m in compared)
        axes.set_ylim(max(0.3 * min(finals), _LEAST * top) * scale, 3.0 * top * scale)
        axes.yaxis.set_major_formatter("{x:g}")
        axes.annotate(
            f"peak {peak:.4g} at {metrics.peak_time:.3f} s", (metrics.peak_time, peak),
            xytext=(0, 6), textcoords="offset points", color=RUN,
            ha=_towards_the_middle(metrics.peak_time, path["time"]),
        )  # fmt: skip
    if metrics.in_band_from is not None:
        axes.axvline(metrics.in_band_from, color=RUN, lw=0.8, ls=":", zorder=1)
        # On the upper edge, because the room above every peak is for labels.
        axes.plot(
            metrics.in_band_from, 1.0, "v", color=RUN, mec="k", ms=8, zorder=4, clip_on=False,
            transform=axes.get_xaxis_transform(),
        )  # fmt: skip
    label_at_right(axes, labels)


def _final(metrics: Metrics, scale: float, name: str) -> str:
    """Return the label of a run's curve: final whirl, which ``scale`` converts from m, and name."""
    changing = "" if metrics.settled else ",\nstill changing"
    return f"{metrics.final_whirl * scale:.3g}  {name}{changing}"


def _towards_the_middle(at: float, time: np.ndarray) -> str:
    """Return the alignment of a text at the time ``at`` that keeps the text within the axes."""
    part = (at - time[0]) / (time[-1] - time[0])
    return "left" if part < 0.15 else "right" if part > 0.85 else "center"


def _rises(path: Trajectory, scene: Scene) -> bool:
    """Return whether the deck moves along the shaft by more than rounding."""
    least = _LEAST * max(path.whirl.max(), scene.whirl_unit[0])
    return path.tilts and bool(np.ptp(path["z"]) > least)


def _draw_height(axes: Axes, path: Trajectory) -> None:
    draw_curve(axes, path["time"], 1e6 * path["z"], color=RUN, lw=1.3)
    axes.set_ylabel("height z [um]")


def _draw_tilt(axes: Axes, path: Trajectory, scene: Scene) -> None:
    """Draw the deck's angles, each in its own colour; gamma, about the shaft, is drawn first."""
    angles = 1e3 * (path.tilt - rest_of(scene).tilt)
    labels, least = [], _LEAST * np.abs(angles).max()
    for axis, (name, color) in enumerate(zip(_TILT, SERIES, strict=True)):
        if np.abs(angles[:, axis]).max() <= least:
            labels.append(Label(0.0, f"{name}: 0", color))
            continue
        draw_curve(axes, path["time"], angles[:, axis], color=color, lw=1.2, zorder=4 - axis)
        labels.append(Label(angles[-1, axis], name, color))
    axes.set_ylabel("tilt [mrad]")
    label_at_right(axes, labels)


def _draw_torque(axes: Axes, path: Trajectory, motor: Motor) -> None:
    """Draw the motor's torque, its upper limit, and the lower limit if it is nearly reached."""
    time, torque, speed = path["time"], path["motor_torque"], path["speed"]
    axes.plot(time, torque, color=RUN, lw=1.2)
    axes.set_ylabel("motor torque [N m]")
    labels = [Label(torque[-1], "torque", RUN)]
    for sign, text in ((1.0, "largest torque\nat this speed"), (-1.0, "largest braking torque")):
        limit = sign * motor.torque_limit - motor.back_emf_slope * speed
        # Draw the lower limit only if it is nearly reached, because it compresses the curve.
        if sign > 0 or np.any(torque < 0.5 * limit):
            # Broad and behind, so that it is visible where the torque is at the limit.
            axes.plot(time, limit, color="0.8", lw=5.0, zorder=1)
            labels.append(Label(limit[-1], text, LIMIT))
    label_at_right(axes, labels)


def _draw_forces(axes: Axes, path: Trajectory, scene: Scene) -> None:
    """Draw the driving force on each ball."""
    forces = driving_forces(path, scene)
    for ball, style in enumerate(ball_styles(path.balls)):
        draw_curve(axes, path["time"], forces[:, ball], **style)
    axes.set_ylabel("driving force\non the balls [N]")
    axes.axhline(0, color="k", lw=0.5)


def _mark_period(panels: Sequence[Axes], scene: Scene, start: float) -> None:
    """Shade the variable-speed period, which begins at a time [s], in all panels."""
    profile = scene.profile
    assert profile is not None and profile.kind == "start_up"
    assert profile.variable_speed_period is not None
    end = start + profile.variable_speed_period.duration
    for axes in panels:
        axes.axvspan(start, end, color=GREEN, alpha=0.12, lw=0)
    panels[0].annotate(
        "variable-speed period",
        (end, 0),
        xycoords=("data", "axes fraction"),
        xytext=(4, 5),
        textcoords="offset points",
        fontsize=8,
        color=GREEN,
    )


OPPOSITE = -180.0
"""Angle of the side opposite the unbalance [deg]."""
_MOST_LABELS = 8
"""Largest number of balls with names."""


def _draw_balls(axes: Axes, path: Trajectory, scene: Scene, metrics: Metrics) -> None:
    """Draw ball angles, or speeds if balls circulate, because many turns of angle are illegible.

    Parameters
    ----------
    axes
        Axes to draw on.
    path
        Consecutive samples, from the start to the end.
    scene
        Scene of the run.
    metrics
        Metrics of the run.
    """
    if metrics.circulating is None:
        _draw_angles(axes, path, metrics)
    else:
        _draw_speeds(axes, path, scene, metrics)


def _draw_speeds(axes: Axes, path: Trajectory, scene: Scene, metrics: Metrics) -> None:
    """Draw the speed of each ball in space, with the speeds at which balls circulate."""
    time, circulation = path["time"], metrics.circulating
    assert circulation is not None
    labels = [Label(path["speed"][-1], "spindle", RUN)]
    axes.plot(time, path["speed"], color=RUN, lw=1.0, ls="--", zorder=3)
    for ball, style in enumerate(ball_styles(path.balls)):
        draw_curve(axes, time, path["speed"] + path.ball_rates[:, ball], **style)
        if path.balls <= _MOST_LABELS and ball not in circulation.balls:
            labels.append(Label(path["speed"][-1], f"ball {ball}", style["color"]))
    for speed in sorted({float(f"{speed:.3g}") for speed in circulation.speeds}):
        many = sum(
            float(f"{circulating_speed:.3g}") == speed for circulating_speed in circulation.speeds
        )
        what = "ball circulates" if many == 1 else "balls circulate"
        labels.append(Label(speed, f"{many} {what}\nat {speed:g} rad/s"))
    if scene.critical_speed is not None:
        axes.axhline(scene.critical_speed, color=LIMIT, lw=0.8, ls=":")
        labels.append(Label(scene.critical_speed, "critical speed", LIMIT))
    axes.set_ylabel("speed of the balls\n[rad/s]")
    label_at_right(axes, labels[:_MOST_LABELS])


def _draw_angles(axes: Axes, path: Trajectory, metrics: Metrics) -> None:
    """Draw ball angles within a turn, the side opposite the unbalance, and its first passage."""
    time, angles = path["time"], in_degrees(path.ball_angles)
    labels = []
    for ball, style in enumerate(ball_styles(path.balls)):
        axes.plot(time, angles[:, ball], **style)
        if path.balls <= _MOST_LABELS:
            labels.append(Label(angles[-1, ball], f"ball {ball}", style["color"]))
    low, high = min(np.nanmin(angles), OPPOSITE), max(np.nanmax(angles), OPPOSITE)
    margin = max(0.06 * (high - low), 15.0)
    low, high = low - margin, high + margin
    axes.axhline(OPPOSITE, color=LIMIT, lw=0.9, ls=":")
    labels.append(Label(OPPOSITE, "opposite the unbalance", LIMIT))
    axes.set_ylim(low, high)
    ticks = next((base for base in (15, 30, 45) if high - low <= 8 * base), 90)
    axes.yaxis.set_major_locator(MultipleLocator(ticks, offset=0))
    axes.set_ylabel("ball angle from\nthe unbalance [deg]")
    passed = metrics.first_passage_of_opposite
    if passed is not None and passed > 0:
        axes.plot(passed, OPPOSITE, "ko", ms=5, zorder=4)
        # Curves come from above and continue to the right: there is room below on the left, or
        # above.
        late = passed > 0.3 * time[-1]
        axes.annotate(
            f"all balls at -180 deg first: {passed:.3f} s", (passed, OPPOSITE), fontsize=8,
            xytext=(-8, -10) if late else (8, 8), textcoords="offset points",
            ha="right" if late else "left",
        )  # fmt: skip
    label_at_right(axes, labels)
