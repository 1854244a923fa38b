"""Blind identification of random drives from noisy recordings: success, accuracy, intervals.

    python benchmarks/identification.py [--out docs] [--drives 20] [--friction 6] [--coverage 60]
        [--effects 10] [--ringing 400] [--far 200] [--seed 0] [--only PART,PART] [--lines FILE]

writes identification.json and identification.md. Recordings are simulated displacements at 1 kHz
with 1 % noise, one with the balls and one without. Times are CPU times of one process.

- drives: random drives whose parameters and start angles the fit does not know; its scene is off by
  up to 35 % in each parameter. A fit is right if all values are within six of its standard
  deviations and the residuals are as large as the noise. Errors are compared with the bound of
  Cramer and Rao, the least standard deviation of an unbiased estimate from these recordings
- friction: the same with rolling friction
- coverage: fits that start at the true values, and the share of 95 % intervals with the truth
- effects: drives with one more effect than the fitted scene, which changes the signals by 0.5 to 2
  times their noise: whether it is flagged (z > 4), and named first
- ringing: recordings without balls of speed and one or two signals, of drives that may ring after
  a fast run-up: number of refusals and of right fits
- far: drives whose start values are 20 to 60 % off, every second one with an unknown zero of the
  encoder. A fit is right if all values are within three times their interval and within 1 %

``--only`` measures these parts, and takes the others from the existing identification.json.
``--lines`` appends each case to a file, and takes existing cases from it.
"""

import json
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from arguments import arguments  # noqa: E402
from identification_drives import (  # noqa: E402
    NOISE,
    Blind,
    blind_drive,
    drive_with,
    recordings_of,
    ringing_drive,
    table_of,
)
from identification_page import write_page  # noqa: E402
from rich.console import Console  # noqa: E402

from ab_sim.analysis.effect_cost import conditions  # noqa: E402
from ab_sim.base.errors import InputError  # noqa: E402
from ab_sim.cli.outputs import write_json  # noqa: E402
from ab_sim.identification.information import deviations_of  # noqa: E402
from ab_sim.identification.intervals import intervals_of  # noqa: E402
from ab_sim.identification.measured import Measured  # noqa: E402
from ab_sim.identification.missing import as_good_as_the_best  # noqa: E402
from ab_sim.identification.parameters import fitted_parameters  # noqa: E402
from ab_sim.identification.problem import Problem  # noqa: E402
from ab_sim.identification.residuals import noises_of, whiteness_over  # noqa: E402
from ab_sim.identification.result import FITS, Identification  # noqa: E402
from ab_sim.identification.run import IdentificationSettings, run_identification  # noqa: E402
from ab_sim.identification.stages import LAST_STEPS, minimise  # noqa: E402

RIGHT, LARGEST = 6.0, 1.1
"""Limits of a right fit: standard deviations, and ratio of residuals to noise."""
INTERVALS, ERROR = 3.0, 0.01
"""Limits of a right value from a far start: half-widths of the interval, and relative error."""
EFFECTS = ("hardening_suspension", "unequal_suspension", "race_runout", "rolling_friction")
ANGLES = "start angles [rad]"


def quiet(*_: object) -> None:
    """Ignore progress."""


def errors_of(found: Identification, blind: Blind) -> dict[str, float]:
    """Return relative errors by name; those of ratios to the mass are named after the ratio."""
    errors = {key: found[key].value / true - 1.0 for key, true in blind.true.items()}
    fitted = sorted(
        each.value % (2 * np.pi) for each in found.estimates if each.name.startswith("start angle")
    )
    true = sorted(angle % (2 * np.pi) for angle in blind.angles)
    turns = [np.roll(fitted, k) - true for k in range(len(true))]
    off = min(float(np.max(np.abs((turn + np.pi) % (2 * np.pi) - np.pi))) for turn in turns)
    return {**errors, ANGLES: off}


def bounds_of(blind: Blind, recordings: list[Measured]) -> dict[str, float]:
    """Return the bounds of Cramer and Rao at the truth, by the names of ``errors_of``."""
    common = fitted_parameters(blind.scene, list(blind.true), {})
    problem = Problem(blind.scene, common, recordings, [1.0] * len(recordings))
    true = np.array([*blind.true.values(), *blind.angles])
    shown = [problem.simulated(k, true) for k in range(len(recordings))]
    noise = [NOISE * float(np.sqrt(np.mean(np.square(each)))) for each in shown]
    derivatives = problem.with_noise(noise).derivatives(true, range(len(true)))
    bounds = deviations_of(derivatives) * problem.scales / np.abs([*blind.true.values(), 1.0, 1.0])
    return {
        **dict(zip(blind.true, bounds.tolist(), strict=False)),
        ANGLES: float(bounds[-2:].max()),
    }


def fitted(
    blind: Blind, recordings: list[Measured], seed: int
) -> tuple[Identification, dict[str, Any]]:
    """Fit a drive; return the result and the figures that all parts have in common."""
    begin = time.process_time()
    settings = IdentificationSettings(tuple(blind.true), seed=seed, propose=False)
    found = run_identification(blind.guess, recordings, settings)
    return found, {
        "seed": seed,
        "seconds": time.process_time() - begin,
        "verdict": found.verdict,
        "z": [each.worst for each in found.whiteness],
    }


def identified(seed: int, friction: bool) -> dict[str, Any]:
    """Identify a drive blindly."""
    blind = blind_drive(seed, friction)
    recordings = recordings_of(blind.scene, seed)
    found, common = fitted(blind, recordings, seed)
    errors = errors_of(found, blind)
    off = {
        key: float((found[key].value - true) / found[key].deviation)
        for key, true in blind.true.items()
    }
    noise = max(each.share / 0.01 for each in found.whiteness)
    right = max(map(abs, off.values())) < RIGHT and noise < LARGEST
    angles = [each.deviation for each in found.estimates if each.name.startswith("start angle")]
    return {
        **common,
        "right": right,
        "runs": found.runs,
        "errors": errors,
        "bounds": bounds_of(blind, recordings),
        "deviations_off": {**off, ANGLES: errors[ANGLES] / max(angles)},
        "noise": noise,
    }


def covered(seed: int, friction: bool) -> dict[str, Any]:
    """Count the intervals that contain the truth, for a fit that starts there."""
    blind = blind_drive(seed, friction)
    recordings = recordings_of(blind.scene, seed)
    problem = Problem(
        blind.guess,
        fitted_parameters(blind.guess, list(blind.true), {}),
        recordings,
        noises_of(recordings),
    )
    true = np.array([*blind.true.values(), *blind.angles])
    free = range(len(true))
    fit = minimise(problem, true, free, LAST_STEPS, last=True)
    found = intervals_of(problem, fit.values, free, quiet, profiles=False)
    off = (fit.values - true) / np.array([each.deviation for each in found.estimates])
    return {
        "seed": seed,
        "deviations_off": off.tolist(),
        "names": list(problem.names),
        "z": [each.worst for each in whiteness_over(problem, fit.values)],
    }


def with_effect(seed: int) -> dict[str, Any]:
    """Identify a drive that has one more effect than the scene."""
    name = EFFECTS[seed % len(EFFECTS)]
    blind = blind_drive(seed, False)
    richer, change = drive_with(blind, name, seed)
    found, common = fitted(blind, recordings_of(richer, seed), seed)
    return {
        **common,
        "effect": name,
        "change": change,
        "flagged": not all(each.white for each in found.whiteness),
        "named": as_good_as_the_best(found.tried),
    }


def judged(blind: Blind, recordings: list[Measured], seed: int) -> dict[str, Any]:
    """Fit, and compare the values with the true ones."""
    found, common = fitted(blind, recordings, seed)
    values = [(found[key], value) for key, value in blind.true.items()]
    errors = {each.name: each.value / value - 1.0 for each, value in values}
    widths = {each.name: abs(each.value - value) / (0.5 * (each.high - each.low))
              for each, value in values}  # fmt: skip
    inside = max(widths.values()) <= INTERVALS
    return {
        **common,
        "right": inside and max(map(abs, errors.values())) <= ERROR,
        "wrong_but_fits": not inside and found.verdict == FITS,
        "errors": errors,
        "intervals_off": widths,
    }


def ringing(seed: int) -> dict[str, Any]:
    """Read and fit a recording of a drive that may ring."""
    blind, drawn = ringing_drive(seed)
    found: dict[str, Any] = {"seed": seed, **drawn, "refused": "", "doubt": False}
    with tempfile.TemporaryDirectory() as folder:
        try:
            measured = table_of(blind, drawn, seed, Path(folder) / "bare.parquet")
            found["doubt"] = bool(measured.doubt)
            return {**found, **judged(blind, [measured], seed)}
        except InputError as error:
            return {**found, "refused": str(error)}


def far_start(seed: int) -> dict[str, Any]:
    """Fit a pair of recordings from far start values."""
    blind, zero_known = blind_drive(seed, False, far=True), seed % 2 == 0
    recordings = recordings_of(blind.scene, seed, zero_known)
    return {"zero_known": zero_known, **judged(blind, recordings, seed)}


def main() -> None:
    """Run, and write JSON and page."""
    parser = arguments(__doc__.splitlines()[0], 1)
    counts = {"drives": 20, "friction": 6, "coverage": 60, "effects": 10, "ringing": 400,
              "far": 200}  # fmt: skip
    for name, count in counts.items():
        parser.add_argument(f"--{name}", type=int, default=count, help=f"how many of {name}")
    parser.add_argument("--seed", type=int, default=0, help="of the first drive")
    parser.add_argument("--only", default="", help="parts that are measured, with commas between")
    parser.add_argument("--lines", type=Path, help="JSON lines of finished cases")
    told = parser.parse_args()
    lines = told.lines.read_text().splitlines() if told.lines and told.lines.exists() else []
    before = {(each["part"], each["seed"]): each for each in map(json.loads, lines)}
    console, file = Console(), told.out / "identification.json"
    only = told.only.split(",") if told.only else []
    report: dict[str, Any] = json.loads(file.read_text()) if only else {"dates": {}}
    report |= {"conditions": conditions(), "seed": told.seed}
    parts = (
        ("drives", lambda seed: identified(seed, False), told.drives),
        ("friction", lambda seed: identified(seed, True), told.friction),
        ("coverage", lambda seed: covered(seed, False), told.coverage),
        ("coverage_friction", lambda seed: covered(seed, True), told.coverage),
        ("effects", with_effect, told.effects),
        ("ringing", ringing, told.ringing),
        ("far", far_start, told.far),
    )
    for name, work, count in parts:
        if only and name not in only:
            continue
        report[name] = []
        report["dates"][name] = report["conditions"]["date"][:16]
        for seed in range(told.seed, told.seed + count):
            case = before.get((name, seed)) or {"part": name, **work(seed)}
            if told.lines and (name, seed) not in before:
                with told.lines.open("a") as cases:
                    cases.write(json.dumps(case) + "\n")
            report[name].append(case)
            console.print(case)
        write_json(report, str(file))
    write_page(told.out)


if __name__ == "__main__":
    main()
