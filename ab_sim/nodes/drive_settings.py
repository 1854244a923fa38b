"""The parameters of `drive_sim`, and their conversion for its parts."""

import enum
import math
from typing import Any, NamedTuple

from rclpy.node import Node

from ab_sim.nodes.command_path import Rules, WatchdogAction
from ab_sim.nodes.drive_health import RealTimeTolerance
from ab_sim.nodes.parameters import ParameterSpec, declare, whole_ratio
from ab_sim.nodes.prepared_drive import Rates
from ab_sim.nodes.realtime import RealTimeRequests
from ab_sim.nodes.settings import Settings, Values


class TimeMode(enum.Enum):
    """Source of the progress of simulated time."""

    PACED = "paced"
    """The steady clock, times `speed_factor`."""
    FREE = "free"
    """No limit: as fast as possible."""
    LOCK_STEP = "lock_step"
    """Requests of ~/step."""


_MODES = {mode.value: mode for mode in TimeMode}
"""Modes by name; the loop looks them up several times per wake-up, which is slow with an enum."""


class Fixed(NamedTuple):
    """Settings that do not change while the node lives."""

    autostart: bool
    """True if the node configures and activates itself."""
    hardware: str
    """Name of the drive in the diagnostics; empty: namespace and scene."""
    rates: Rates
    per_block: int
    """Wake-ups per block."""
    paused: bool
    """True if the drive starts paused."""
    seed: int
    """Seed of the bus jitter."""
    clock: bool
    """True if simulated time is published."""
    real_time: RealTimeRequests


def fixed_settings(node: Node) -> Fixed:
    """Declare the parameters that do not change, and return their values."""

    def number(name: str, default: Any, meaning: str, unit: str, low: float, high: float) -> Any:
        return declare(node, name, default, meaning, unit, (low, high))

    rates = Rates(
        number("wake_rate", 250.0, "wake-ups, each publishing once", "1/s", 1.0, 2000.0),
        number("block_rate", 50.0, "blocks of samples", "1/s", 0.1, 1000.0),
        number("patience", 0.5, "lag beyond which steps are dropped", "s", 0.01, 60.0),
        number("catch_up", 10.0, "most steps at one wake-up, in wake-ups", "1", 1.0, 1e4),
    )
    priority = "of the loop's thread, by SCHED_FIFO; 0: scheduled as usual"
    by_hand = "search for garbage once a second, after reports"
    meaning = "configure and activate without being asked; false: as ROS's life cycle says"
    return Fixed(
        declare(node, "autostart", True, meaning),
        declare(node, "hardware_id", "", "of the drive in /diagnostics; empty: namespace/scene"),
        rates,
        whole_ratio(1.0 / rates.block, 1.0 / rates.wake, "period of block_rate"),
        declare(node, "start_paused", False, "wait for ~/pause with false"),
        number("jitter_seed", 0, "of command_jitter", "1", 0, 2**31),
        declare(node, "publish_clock", True, "whether simulated time goes to /clock"),
        RealTimeRequests(
            number("realtime_priority", 0, priority, "1", 0, 99),
            declare(node, "lock_memory", False, "keep all memory from being swapped out"),
            declare(node, "garbage_by_hand", False, by_hand),
        ),
    )


def drive_settings(node: Node) -> Settings:
    """Declare the parameters that can change at run time."""
    made = Settings(node)
    for meaning, wanted in (
        ("name or YAML file of the scene; a change waits for ~/load_scene, or to be configured",
         ParameterSpec("scene", "thesis-hold")),
        ("changes to the scene, each key=value; new ones wait for the same",
         ParameterSpec("changes", [""])),
        ("what makes simulated time go on",
         ParameterSpec("time_mode", "paced", choices=[mode.value for mode in TimeMode])),
        ("simulated time over the clock's, where time is paced",
         ParameterSpec("speed_factor", 1.0, "1", (0.01, 100.0))),
        ("wake-ups that a request of ~/step takes", ParameterSpec("steps", 1, "1", (1, 10_000))),
        ("commands that ~/step waits for, at most 1 s, before it takes its steps",
         ParameterSpec("await_commands", 0, "1", (0, 100))),
        ("a command beyond this speed is rejected; 0: the scene's spindle.max_speed",
         ParameterSpec("speed_limit", 0.0, "rad/s", (0.0, 1e6))),
        ("of the spindle on its way to a command; 0: the scene's spindle.max_acceleration",
         ParameterSpec("acceleration_limit", 0.0, "rad/s^2", (0.0, 1e9))),
        ("age of the last command, in simulated time, at which the watchdog acts; 0: never",
         ParameterSpec("command_age_limit", 0.0, "s", (0.0, 1e6))),
        ("what the watchdog does: hold the present speed, coast or stop to standstill",
         ParameterSpec("command_silence", "hold", choices=[each.value for each in WatchdogAction])),
        ("of the spindle where the watchdog lets it coast",
         ParameterSpec("coast_deceleration", 5.0, "rad/s^2", (1e-3, 1e9))),
        ("of every command, to mimic a bus, in simulated time",
         ParameterSpec("command_delay", 0.0, "s", (0.0, 10.0))),
        ("what a command may take longer by, at random, in simulated time",
         ParameterSpec("command_jitter", 0.0, "s", (0.0, 10.0))),
        ("how far the real-time factor may be from speed_factor, as a part of that, without a "
         "warning", ParameterSpec("factor_tolerance", 0.05, "1", (0.001, 1.0))),
        ("how late a wake-up may be without a warning",
         ParameterSpec("lateness_tolerance", 0.1, "s", (0.001, 60.0))),
        ("most of the loop's CPU time that estimating the error may take; 0: no estimate",
         ParameterSpec("error_checks", 0.05, "1", (0.0, 0.5))),
        ("file for ~/save_snapshot and ~/restore_snapshot",
         ParameterSpec("snapshot", "drive.json")),
        ("what is broken, e.g. ['ball_0 sticks']; a change waits for ~/inject_faults",
         ParameterSpec("faults", [""])),
        ("of the disc for ~/load_disc", ParameterSpec("disc_eccentricity", 0.0, "m", (0.0, 1.0))),
        ("of the disc's unbalance for ~/load_disc, from that of the disc before",
         ParameterSpec("disc_angle", 0.0, "rad", (-1e3, 1e3))),
    ):  # fmt: skip
        made.declare(meaning, wanted)
    return made


def rules_of(values: Values) -> Rules:
    """Return the rules for commands."""
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
    """Return the limits of what counts as real time."""
    return RealTimeTolerance(values["factor_tolerance"], values["lateness_tolerance"])


def mode_of(values: Values) -> TimeMode:
    """Return the mode of time."""
    return _MODES[values["time_mode"]]
