"""Reference cases with published values, as far as the reference simulator covers them."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .deck_params import Ball, Body, DeckParams, Disc, Mount, Race
from .params import Friction, Params, Spindle, Suspension

LITERATURE = Path(__file__).parents[1] / "literature"
ORACLE = LITERATURE / "oracle.json"


def oracle_cases(path: Path = ORACLE) -> dict[str, dict[str, Any]]:
    """Return all cases of the file by their id."""
    return {case["id"]: case for case in json.loads(path.read_text(encoding="utf-8"))["cases"]}


def oracle_params(case: dict[str, Any]) -> Params:
    """Return the parameters of a trajectory case."""
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


def deck_oracle() -> dict[str, Any]:
    """Return trajectories, instants and modes of the deck in space; the file describes them."""
    found: dict[str, Any] = json.loads((LITERATURE / "deck_oracle.json").read_text())
    return found


def deck_params(given: Mapping[str, Any]) -> DeckParams:
    """Return the deck's parameters from ``params`` of a case in ``deck_oracle.json``."""
    disc, spindle = dict(given["disc"]), given["spindle"]
    disc["points"] = tuple((point["mass"], point["position"]) for point in disc["points"])
    races = [{**race, "balls": tuple(Ball(**b) for b in race["balls"])} for race in given["races"]]
    return DeckParams(
        Body(**given["deck"]),
        Disc(**disc),
        tuple(Race(**race) for race in races),
        tuple(Mount(**mount) for mount in given["mounts"]),
        given["gravity"],
        Spindle(spindle["speed"], spindle["angle"], tuple(map(tuple, spindle["segments"]))),
    )
