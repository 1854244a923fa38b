"""Reference cases with published values, as far as the reference simulator covers them."""

import json
from pathlib import Path
from typing import Any

from .params import Friction, Params, Spindle, Suspension

ORACLE = Path(__file__).parents[1] / "literature" / "oracle.json"


def oracle_cases(path: Path = ORACLE) -> dict[str, dict[str, Any]]:
    """All cases of the file, by their id."""
    return {case["id"]: case for case in json.loads(path.read_text())["cases"]}


def oracle_params(case: dict[str, Any]) -> Params:
    """The parameters of a trajectory case."""
    given, n = case["params"], len(case["theta0_rad"])
    return Params(
        mass=given["M"],
        suspension=Suspension.isotropic(given["k"], given["c"]),
        eccentricity=given["e"],
        race_radius=given["R"],
        ball_masses=(given["m"],) * n,
        ball_radii=(given["a"],) * n,
        unbalance_mass=given.get("M0"),
        drag=given["cb"],
        friction=Friction(arm=given["beta_b"]),
        spindle=Spindle(given.get("w0", 0.0), 0.0, tuple(map(tuple, given["profile"]))),
    )
