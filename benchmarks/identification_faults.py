"""Drives with faults, recorded live and identified: result for each fault.

    python benchmarks/identification_faults.py [--out docs] [--keep FOLDER]

writes identification-faults.json, and its part of identification.md. Nodes run as processes in lock
step, faults start a second after the start, and the live recorder writes a recording and a bag of
each run (tests/nodes/faulty_recordings.py). The fit also gets a recording without balls, of the
drive without faults, and starts from a scene that is up to 15 % off. Results:

- identified: the verdict is "fits", and all values are within six of their standard deviations
- refused: with a message before the fit
- flagged: another verdict, with its reasons
- wrong: the verdict is "fits", and a value is further off. There must be none
"""

import sys
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from arguments import arguments, folder  # noqa: E402
from identification_page import write_page  # noqa: E402
from rich.console import Console  # noqa: E402

import ab_sim  # noqa: E402
from ab_sim.analysis.comparison import without_balls  # noqa: E402
from ab_sim.analysis.effect_cost import conditions  # noqa: E402
from ab_sim.base.errors import InputError  # noqa: E402
from ab_sim.cli.outputs import write_json  # noqa: E402
from ab_sim.design.draws import value_of  # noqa: E402
from ab_sim.identification.result import FITS  # noqa: E402
from ab_sim.scene import Scene  # noqa: E402
from ab_sim.scene.load import changed_scene  # noqa: E402
from tests.nodes.faulty_recordings import AT, Live, bench, recorded_live  # noqa: E402

OFF = {
    "effects.suspension.stiffness": 1.1,
    "effects.suspension.damping": 0.85,
    "rotor.eccentricity": 0.85,
    "balls.mass": 1.1,
    "effects.viscous_drag.coefficient": 1.15,
}
"""Fitted keys, and factors by which the start of the fit is off."""
RIGHT = 6.0
"""Limit of a right value in standard deviations."""
RECORDING, BAG, MESSAGES = "recording", "bag", "messages"


class Case(NamedTuple):
    """Fault, and file to identify: the recording, or the sensors' readings."""

    fault: str
    """Fault as text; empty for none."""
    read: str = RECORDING


CASES = (
    Case(""),
    Case("", MESSAGES),
    Case("ball_1 sticks"),
    Case("ball_1 lost"),
    Case("suspension softens 0.7"),
    Case("disc slips 2"),
    Case("pickup saturates 0.5"),
    Case("pickup saturates 0.5", BAG),
    Case("pickup saturates 0.5", MESSAGES),
    Case("pickup drops 0.3", MESSAGES),
    Case("pickup drops 1", MESSAGES),
    Case("pickup drifts 0.1", MESSAGES),
    Case("pickup turned 0.5", MESSAGES),
    Case("spindle saturates 150", MESSAGES),
    Case("spindle drifts 10", MESSAGES),
    Case("spindle drops 1", MESSAGES),
)


def live_run(place: Path, scene: Scene, fault: str, name: str) -> Live:
    """Return a live run, from an earlier call if its files exist."""
    there = Live(place / f"{name}.rrd", place / f"{name}-bag", place / f"{name}-heard.rrd")
    if there.heard.exists():  # the last that is written
        return there
    return recorded_live(place, scene, [fault] if fault else [], name)


def file_of(live: Live, read: str) -> Path:
    """Return the file of a run to identify."""
    return {RECORDING: live.recording, BAG: live.bag, MESSAGES: live.heard}[read]


def outcome(case: Case, live: Live, bare: Live) -> dict[str, Any]:
    """Identify a recording and return the result."""
    scene = bench()
    true = {key: float(value_of(scene, key)) for key in OFF}
    start = changed_scene(scene, {key: OFF[key] * true[key] for key in OFF}, "start")
    files = [file_of(live, case.read), bare.heard if case.read == MESSAGES else bare.recording]
    found: dict[str, Any] = {"fault": case.fault, "read": case.read}
    try:
        fit = ab_sim.identify(files, start, list(OFF), propose=False)
    except InputError as error:
        return {**found, "outcome": "refused", "says": [str(error)]}
    off = {
        key: (fit[key].value - value) / fit[key].deviation if fit[key].deviation else None
        for key, value in true.items()
    }
    near = all(each is not None and abs(each) < RIGHT for each in off.values())
    kind = "flagged" if fit.verdict != FITS else "identified" if near else "wrong"
    return {
        **found,
        "outcome": kind,
        "verdict": fit.verdict,
        "says": list(fit.reasons),
        "notes": list(fit.notes),
        "errors": {key: fit[key].value / value - 1.0 for key, value in true.items()},
        "deviations_off": off,
    }


def main() -> None:
    """Record, identify, and write JSON and page."""
    parser = arguments(__doc__.splitlines()[0], 1)
    parser.add_argument(
        "--keep",
        type=folder,
        help="where recordings stay, and are taken from if they are there; default: nowhere",
    )
    told = parser.parse_args()
    report: dict[str, Any] = {"conditions": conditions(), "at": AT, "cases": []}
    lives: dict[str, Live] = {}
    with tempfile.TemporaryDirectory() as passing:
        place = told.keep or Path(passing)
        bare = live_run(place, without_balls(bench()), "", "bare")
        for case in CASES:
            if case.fault not in lives:
                name = case.fault.replace(" ", "-").replace(".", "_") or "sound"
                lives[case.fault] = live_run(place, bench(), case.fault, name)
            report["cases"].append(outcome(case, lives[case.fault], bare))
            last = report["cases"][-1]
            Console().print(case.fault or "sound", case.read, last["outcome"], last["says"])
            write_json(report, str(told.out / "identification-faults.json"))
    write_page(told.out)


if __name__ == "__main__":
    main()
