"""Pictures for people: the thesis' three-part start-up figure."""

from collections.abc import Sequence
from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")  # no display needed, anywhere
import matplotlib.pyplot as plt  # noqa: E402
from matplotlib.axes import Axes  # noqa: E402

from ab_sim.analysis.startup import driving_forces, peak_whirl, settling_period  # noqa: E402
from ab_sim.scene.model import Scene  # noqa: E402
from ab_sim.trajectory import Trajectory  # noqa: E402

SPEED, WHIRL = "tab:gray", "tab:red"


def startup_figure(
    trajectory: Trajectory,
    scene: Scene,
    path: Path,
    period_start: float | None = None,
    title: str | None = None,
) -> None:
    """Draw speed and W/e, driving force and ball angle over time, and write them to a file.

    With a motor, the speed that it is commanded is drawn too, and its torque.

    Args:
        trajectory: consecutive samples.
        scene: what was run.
        path: file to write; its ending says the format (png, svg, pdf).
        period_start: when the variable-speed period starts [s], if there is one.
        title: default: the scene's name.
    """
    time, e = trajectory["time"], scene.rotor.eccentricity
    motor = scene.effects.get("motor")
    rows = 3 if motor is None else 4
    figure, axes_of = plt.subplots(
        rows, 1, sharex=True, figsize=(9, 9.5 * rows / 3), constrained_layout=True
    )
    top, middle, bottom = axes_of[0], axes_of[-2], axes_of[-1]
    figure.suptitle(title or f"Start-up of {scene.name}", fontsize=14)

    scale, unit = (1 / e, "W/e [1]") if e > 0 else (1e3, "W [mm]")
    top.plot(time, trajectory.whirl * scale, color=WHIRL, lw=1.2)
    top.set_ylabel(f"whirl radius {unit}", color=WHIRL)
    peak, at = peak_whirl(trajectory)
    if peak > 0:
        top.annotate(
            f"peak {peak * scale:.4g} at {at:.3f} s",
            (at, peak * scale),
            xytext=(0, 6),
            textcoords="offset points",
            ha=_towards_the_middle(at, time),
            color=WHIRL,
        )
        top.set_ylim(0, 1.15 * peak * scale)
    speed = top.twinx()
    if motor is not None:
        speed.plot(time, trajectory["command"], color="k", lw=0.8, ls="--", label="commanded")
        _draw_torque(axes_of[1], trajectory, motor.torque_limit)
    speed.plot(time, trajectory["speed"], color=SPEED, lw=1.5, label="actual")
    speed.set_ylabel("spindle speed [rad/s]", color=SPEED)
    if motor is not None:
        speed.legend(loc="lower right", title="speed")
    if scene.critical_speed is not None:
        speed.axhline(scene.critical_speed, color=SPEED, lw=0.8, ls=":")
        speed.annotate(
            "critical speed",
            (time[0], scene.critical_speed),
            xytext=(4, 3),
            textcoords="offset points",
            color=SPEED,
            fontsize=8,
        )

    forces, angles = driving_forces(trajectory, scene), np.degrees(trajectory.ball_angles)
    # Later balls are drawn thinner, so that balls that move as one remain visible.
    widths = np.linspace(3.0, 1.0, max(trajectory.balls, 1))
    for i in range(trajectory.balls):
        middle.plot(time, forces[:, i], lw=widths[i], alpha=0.8, label=f"ball {i}")
        bottom.plot(time, angles[:, i], lw=widths[i], alpha=0.8, label=f"ball {i}")
    middle.set_ylabel("driving force on the balls [N]")
    middle.axhline(0, color="k", lw=0.5)
    bottom.set_ylabel("ball angle from the unbalance [deg]")
    bottom.axhline(-180, color="k", lw=0.8, ls=":")
    bottom.annotate(
        "opposite the unbalance",
        (time[0], -180),
        xytext=(4, 3),
        textcoords="offset points",
        fontsize=8,
    )
    bottom.set_xlabel("time [s]")
    bottom.set_xlim(time[0], time[-1])
    if 0 < trajectory.balls <= 8:
        bottom.legend(loc="upper right")
    if period_start is not None:
        _mark_period(trajectory, scene, period_start, axes_of)
    for axes in axes_of:
        axes.grid(alpha=0.3)
    try:
        figure.savefig(path, dpi=120)
    finally:
        plt.close(figure)


def _towards_the_middle(at: float, time: np.ndarray) -> str:
    """How to align a text at a time, so that it stays within the axes."""
    part = (at - time[0]) / (time[-1] - time[0])
    return "left" if part < 0.15 else "right" if part > 0.85 else "center"


def _draw_torque(axes: Axes, trajectory: Trajectory, limit: float) -> None:
    axes.plot(trajectory["time"], trajectory["motor_torque"], color=SPEED, lw=1.2)
    axes.set_ylabel("motor torque [N m]")
    for bound in (limit, -limit):
        # The lower one only where the motor brakes that hard; it would squeeze the rest.
        if bound > 0 or np.min(trajectory["motor_torque"]) < 0.5 * bound:
            axes.axhline(bound, color="k", lw=0.8, ls=":")
    axes.annotate(
        "torque limit at standstill",
        (trajectory["time"][0], limit),
        xytext=(4, 3),
        textcoords="offset points",
        fontsize=8,
    )


def _mark_period(trajectory: Trajectory, scene: Scene, start: float, rows: Sequence[Axes]) -> None:
    profile = scene.profile
    assert profile is not None and profile.kind == "start_up"
    assert profile.variable_speed_period is not None
    end = start + profile.variable_speed_period.duration
    for axes in rows:
        axes.axvspan(start, end, color="tab:blue", alpha=0.12, lw=0)
    rows[-2].annotate(
        "variable-speed period",
        (start, 0),
        xycoords=("data", "axes fraction"),
        xytext=(3, 5),
        textcoords="offset points",
        fontsize=8,
        color="tab:blue",
    )
    settled = settling_period(trajectory, start)
    if settled is not None:
        rows[-1].plot(start + settled, -180, "ko", ms=5)
        rows[-1].annotate(
            f"settling period {settled:.3f} s",
            (start + settled, -180),
            xytext=(8, 6),
            textcoords="offset points",
        )
