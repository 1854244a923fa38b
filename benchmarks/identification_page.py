"""The page of benchmarks/identification.py."""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import identification_parts
import numpy as np
from page_parts import table

GOALS = {
    "effects.suspension.stiffness": 1e-4,
    "effects.suspension.damping": 2e-3,
    "rotor.eccentricity": 1e-3,
    "balls.mass": 5e-3,
    "effects.viscous_drag.coefficient": 2e-2,
    "effects.rolling_friction.arm": 2e-2,
    "start angles [rad]": 1e-2,
}
"""Errors that there may be, relative but for the angles."""
SECONDS = 10.0
INSIDE = 1.959964


PARTS = {
    "identification-knowledge.json": identification_parts.knowledge,
    "identification-faults.json": identification_parts.faults,
}
"""What others write, and how it is shown."""


def write_page(folder: Path) -> None:
    """Write the page from the JSON files that are there."""
    parts: list[str] = []
    if (file := folder / "identification.json").exists():
        parts += _main(json.loads(file.read_text()))
    for name, part in PARTS.items():
        if (file := folder / name).exists():
            parts += part(json.loads(file.read_text()))
    (folder / "identification.md").write_text("\n\n".join(parts) + "\n", encoding="utf-8")


def _main(report: dict[str, Any]) -> list[str]:
    """Of identification.py."""
    return [
        "# How well drives are identified",
        "Written by `python benchmarks/identification.py`, from `identification.json`. Recordings "
        "are simulated, 1 kHz, 1 % noise, one with the balls and one without; the total mass is "
        "known. Times are CPU times of one process, kernels compiled.",
        _conditions(report["conditions"], report["dates"]),
        "## Blind",
        table(
            ["", "drives", "right", f"right within {SECONDS:g} s", "CPU s, median", "CPU s, most"],
            [_blind("smooth", report["drives"]), _blind("rolling friction", report["friction"])],
        ),
        "Right: all values within six of their own standard deviations, residuals as large as the "
        "noise.",
        "## Errors of those that are right",
        table(
            ["of", "goal", "drives: 95 %", "most", "with friction: median", "most"],
            _errors(report),
        ),
        "## What the noise allows",
        "The bound of Cramer and Rao, computed at each drive's true values, is the least standard "
        "deviation that an unbiased estimate from its two recordings can have. With normal errors "
        "of just these deviations so many would be above the goal as stand under *by chance*: "
        "where as many are, they are no fault of the fit.",
        table(
            ["of", "goal", "bound: median", "most", "drives whose bound is above the goal",
             "whose interval of 95 % at best is", "errors above the goal",
             "by chance", "most error [own deviations]"],
            _allowed(report),
        ),
        *_misses(report),
        "## Coverage of the intervals of 95 %",
        table(
            ["", "fits", "values", "inside", "least of a parameter"],
            [
                _coverage("smooth", report["coverage"]),
                _coverage("rolling friction", report["coverage_friction"]),
            ],
        ),
        "These fits begin at the true values: the search is judged above. Goal: .93 to .97.",
        "## Missing effects",
        table(["effect", "changes signals by [noise]", "z", "flagged", "named first"],
              _effects(report["effects"])),
        "Friction of the race and of rolling are the same law where balls are equal: both are "
        "named.",
        _summary(report),
    ]  # fmt: skip


def _conditions(found: dict[str, Any], dates: dict[str, str]) -> str:
    said = ", ".join(f"{name.replace('_', ' ')} {date} UTC" for name, date in dates.items())
    machine = found["machine"]
    load = ", ".join(f"{each:.0f}" for each in machine["load_average"])
    versions = ", ".join(f"{name} {each}" for name, each in found["versions"].items())
    return (
        f"Measured: {said}. {machine['processor']}, {machine['cores']} cores, load {load} from "
        f"other work; {versions}."
    )


def _blind(name: str, drives: Sequence[dict[str, Any]]) -> list[str]:
    if not drives:
        return [name, "0", "-", "-", "-", "-"]
    seconds = [each["seconds"] for each in drives]
    soon = sum(each["right"] and each["seconds"] <= SECONDS for each in drives)
    right = sum(each["right"] for each in drives)
    return [
        name, str(len(drives)), str(right), str(soon), f"{np.median(seconds):.1f}",
        f"{max(seconds):.1f}",
    ]  # fmt: skip


def _errors(report: dict[str, Any]) -> list[list[str]]:
    rows = []
    for key, goal in GOALS.items():
        smooth, friction = (
            np.abs([each["errors"][key] for each in report[part]
                    if each["right"] and key in each["errors"]])
            for part in ("drives", "friction")
        )  # fmt: skip
        cells = [key, f"{goal:.2g}"]
        cells += _two(smooth, 0.95) + _two(friction, 0.5)
        rows.append(cells)
    return rows


def _allowed(report: dict[str, Any]) -> list[list[str]]:
    """Goals beside bounds, over all drives."""
    rows = []
    for key, goal in GOALS.items():
        drives = [
            each
            for part in ("drives", "friction")
            for each in report[part]
            if key in each["bounds"]
        ]
        if not drives:
            continue
        bounds = np.array([each["bounds"][key] for each in drives])
        off = [abs(each["deviations_off"][key]) for each in drives if key in each["deviations_off"]]
        chance = sum(math.erfc(goal / bound / math.sqrt(2.0)) for bound in bounds.tolist())
        beyond = sum(abs(each["errors"][key]) > goal for each in drives)
        rows.append(
            [key, f"{goal:.2g}", f"{np.median(bounds):.2g}", f"{bounds.max():.2g}",
             _share(bounds > goal), _share(INSIDE * bounds > goal), f"{beyond} of {len(drives)}",
             f"{chance:.1f}", f"{max(off):.1f}" if off else "-"]
        )  # fmt: skip
    return rows


def _share(which: np.ndarray) -> str:
    return f"{100 * which.mean():.0f} %"


def _misses(report: dict[str, Any]) -> list[str]:
    """Each error above its goal, with what the noise allows; empty where there is none."""
    rows = [
        [key, str(each["seed"]), f"{each['errors'][key]:.2g}", f"{each['bounds'][key]:.2g}",
         f"{each['errors'][key] / each['bounds'][key]:.1f}"]
        for part in ("drives", "friction")
        for each in report[part]
        for key, goal in GOALS.items()
        if key in each["errors"] and abs(each["errors"][key]) > goal
    ]  # fmt: skip
    heads = ["above the goal", "seed", "error", "bound", "error / bound"]
    return [table(heads, rows)] if rows else []


def _two(errors: np.ndarray, share: float) -> list[str]:
    if not len(errors):
        return ["-", "-"]
    return [f"{np.quantile(errors, share):.2g}", f"{errors.max():.2g}"]


def _coverage(name: str, fits: Sequence[dict[str, Any]]) -> list[str]:
    if not fits:
        return [name, "0", "-", "-", "-"]
    off = np.abs(np.array([each["deviations_off"] for each in fits]))
    inside = off < INSIDE
    return [
        name, str(len(fits)), str(off.size), f"{inside.mean():.3f}",
        f"{inside.mean(axis=0).min():.3f}",
    ]  # fmt: skip


def _effects(found: Sequence[dict[str, Any]]) -> list[list[str]]:
    return [
        [each["effect"], f"{each['change']:.2f}", f"{max(each['z']):.1f}",
         "yes" if each["flagged"] else "no", ", ".join(each["named"]) or "-"]
        for each in found
    ]  # fmt: skip


def _summary(report: dict[str, Any]) -> str:
    effects = report["effects"]
    flagged = sum(each["flagged"] for each in effects)
    named = sum(each["effect"] in each["named"] for each in effects)
    right = [each for part in ("drives", "friction") for each in report[part] if each["right"]]
    z = [x for part in (right, report["coverage"], report["coverage_friction"])
         for each in part for x in each["z"]]  # fmt: skip
    alarms = sum(x > 4.0 for x in z)
    most = max(z, default=0.0)
    return (
        f"Flagged {flagged} of {len(effects)}, named first {named}. False alarms of true models: "
        f"{alarms} of {len(z)} recordings have z > 4, the largest is {most:.1f}. z is the larger "
        "one of what Ljung and Box ask and of whether what is left turns with the spindle."
    )
