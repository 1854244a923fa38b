"""Parameters of `drive_sim`, and their conversion to settings of drive, pacing and outputs."""

import enum
import math

from ab_sim.nodes.command_path import Rules, WatchdogAction
from ab_sim.nodes.drive_health import RealTimeTolerance
from ab_sim.nodes.parameters import LOAD, ParameterSpec, Values, whole_ratio
from ab_sim.nodes.prepared_drive import Rates
from ab_sim.nodes.realtime import RealTimeRequests


class TimeMode(enum.Enum):
    """Ways in which simulated time advances."""

    PACED = "paced"
    """By the steady clock, times `speed_factor`."""
    FREE = "free"
    """Without pauses, as fast as possible."""
    LOCK_STEP = "lock_step"
    """Only by requests of ~/step."""


_MODES = {mode.value: mode for mode in TimeMode}
"""Modes by name; the loop looks them up several times per wake-up, which is slow with an enum."""


DRIVE_PARAMETERS = (
    ParameterSpec(
        "autostart",
        True,
        "configure and activate the node automatically; false: wait for lifecycle requests",
        fixed=True,
    ),
    ParameterSpec(
        "hardware_id",
        "",
        "identifier of the drive in /diagnostics; empty: namespace/scene",
        fixed=True,
    ),
    ParameterSpec(
        "wake_rate",
        250.0,
        "rate of wake-ups, each of which takes commands, steps and publishes",
        "1/s",
        (1.0, 2000.0),
        fixed=True,
    ),
    ParameterSpec(
        "publish_rate",
        0.0,
        "rate of joint_states, vibration, whirl, deck_pose and tf, for slow links; 0: wake_rate",
        "1/s",
        (0.0, 2000.0),
        fixed=True,
    ),
    ParameterSpec(
        "block_rate",
        50.0,
        "rate of vibration/block, which has all samples",
        "1/s",
        (0.1, 1000.0),
        fixed=True,
    ),
    ParameterSpec(
        "patience",
        0.5,
        "lag of simulated behind real time beyond which steps are dropped",
        "s",
        (0.01, 60.0),
        fixed=True,
    ),
    ParameterSpec(
        "catch_up",
        10.0,
        "largest number of steps at one wake-up, in multiples of its usual number",
        "1",
        (1.0, 1e4),
        fixed=True,
    ),
    ParameterSpec(
        "start_paused",
        False,
        "start with simulated time paused, until ~/pause with false",
        fixed=True,
    ),
    ParameterSpec(
        "jitter_seed", 0, "seed of the random command_jitter", "1", (0, 2**31), fixed=True
    ),
    ParameterSpec("publish_clock", True, "whether to publish simulated time on /clock", fixed=True),
    ParameterSpec(
        "realtime_priority",
        0,
        "SCHED_FIFO priority of the loop's thread; 0: normal scheduling",
        "1",
        (0, 99),
        fixed=True,
    ),
    ParameterSpec("lock_memory", False, "lock all memory, so that none is swapped out", fixed=True),
    ParameterSpec(
        "garbage_by_hand",
        False,
        "collect Python's garbage only once per second, after reports",
        fixed=True,
    ),
    LOAD,
    ParameterSpec(
        "scene",
        "thesis-hold",
        "name or YAML file of the scene; a change takes effect at ~/load_scene or configuration",
    ),
    ParameterSpec(
        "changes", [""], "changes to the scene, each key=value; they take effect with the scene"
    ),
    ParameterSpec(
        "worlds",
        "",
        "folder of scenes that LoadWorld may load in addition to those of ab_sim; empty: none",
        fixed=True,
    ),
    ParameterSpec(
        "time_mode",
        "paced",
        "way in which simulated time advances: paced by the clock, free (as fast as possible), or "
        "lock_step (by ~/step)",
        choices=[mode.value for mode in TimeMode],
    ),
    ParameterSpec(
        "speed_factor",
        1.0,
        "ratio of simulated to real time in time_mode paced",
        "1",
        (0.01, 100.0),
    ),
    ParameterSpec("steps", 1, "number of wake-ups per request of ~/step", "1", (1, 10_000)),
    ParameterSpec(
        "await_commands",
        0,
        "number of commands for which ~/step waits, at most 1 s, before it steps",
        "1",
        (0, 100),
    ),
    ParameterSpec(
        "speed_limit",
        0.0,
        "largest commanded speed; larger ones are rejected; 0: the scene's spindle.max_speed",
        "rad/s",
        (0.0, 1e6),
    ),
    ParameterSpec(
        "acceleration_limit",
        0.0,
        "acceleration of the spindle towards a commanded speed; 0: the scene's "
        "spindle.max_acceleration",
        "rad/s^2",
        (0.0, 1e9),
    ),
    ParameterSpec(
        "command_age_limit",
        0.0,
        "age of the last command, in simulated time, at which the watchdog acts; 0: off",
        "s",
        (0.0, 1e6),
    ),
    ParameterSpec(
        "command_silence",
        "hold",
        "reaction of the watchdog: hold the present speed, coast to standstill, or stop",
        choices=[action.value for action in WatchdogAction],
    ),
    ParameterSpec(
        "coast_deceleration",
        5.0,
        "deceleration with which the watchdog coasts",
        "rad/s^2",
        (1e-3, 1e9),
    ),
    ParameterSpec(
        "command_delay",
        0.0,
        "delay of each command, in simulated time, to imitate a bus",
        "s",
        (0.0, 10.0),
    ),
    ParameterSpec(
        "command_jitter",
        0.0,
        "largest random addition to command_delay, in simulated time",
        "s",
        (0.0, 10.0),
    ),
    ParameterSpec(
        "factor_tolerance",
        0.05,
        "relative deviation of the real-time factor from speed_factor above which the node warns",
        "1",
        (0.001, 1.0),
    ),
    ParameterSpec(
        "lateness_tolerance",
        0.1,
        "lateness of a wake-up above which the node warns",
        "s",
        (0.001, 60.0),
    ),
    ParameterSpec(
        "error_checks",
        0.05,
        "largest fraction of the loop's CPU time for estimating the error; 0: no estimate",
        "1",
        (0.0, 0.5),
    ),
    ParameterSpec(
        "snapshot", "drive.json", "file of the state for ~/save_snapshot and ~/restore_snapshot"
    ),
    ParameterSpec(
        "faults", [""], "faults, e.g. ['ball_0 sticks']; a change takes effect at ~/inject_faults"
    ),
    ParameterSpec(
        "disc_eccentricity",
        -1.0,
        "eccentricity of the disc that ~/load_disc loads; negative: not set",
        "m",
        (-1.0, 1.0),
    ),
    ParameterSpec(
        "disc_angle",
        0.0,
        "angle from the previous disc's unbalance to that of the disc that ~/load_disc loads",
        "rad",
        (-1e3, 1e3),
    ),
)
"""All parameters of `drive_sim`."""


def rates_of(values: Values) -> Rates:
    """Return the rates of the main loop, and limits of how far it may lag behind real time.

    Raises
    ------
    InputError
        A publication period is not a whole number of wake-ups.
    """
    wake = values["wake_rate"]
    per_state, per_block = (
        whole_ratio(1.0 / (values[rate] or wake), 1.0 / wake, f"period of {rate}")
        for rate in ("publish_rate", "block_rate")
    )
    return Rates(wake, per_state, per_block, values["patience"], values["catch_up"])


def real_time_of(values: Values) -> RealTimeRequests:
    """Return the real-time options that the main loop requests of the system."""
    return RealTimeRequests(
        values["realtime_priority"], values["lock_memory"], values["garbage_by_hand"]
    )


def rules_of(values: Values) -> Rules:
    """Return the settings of the command path."""
    return Rules(
        max_speed=values["speed_limit"] or math.inf,
        max_acceleration=values["acceleration_limit"] or math.inf,
        age_limit=values["command_age_limit"] or math.inf,
        silence=WatchdogAction(values["command_silence"]),
        coast=values["coast_deceleration"],
        delay=values["command_delay"],
        jitter=values["command_jitter"],
    )


def tolerance_of(values: Values) -> RealTimeTolerance:
    """Return the limits within which the drive counts as running in real time."""
    return RealTimeTolerance(values["factor_tolerance"], values["lateness_tolerance"])


def mode_of(values: Values) -> TimeMode:
    """Return the way in which simulated time advances."""
    return _MODES[values["time_mode"]]
