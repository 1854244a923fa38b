"""Dimensions of a drive, and its drawings in a recording."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ab_sim.base.errors import RecordingError
from ab_sim.drive.urdf import ball_radius
from ab_sim.record.recording.curves import Curves
from ab_sim.record.recording.explanation import Explanation
from ab_sim.record.recording.shapes import Arrows, Parts, Space, TopView


@dataclass(frozen=True)
class Drawing:
    """Dimensions of a drive, with the drawings and curves that a recording shows of the drive."""

    race_radius: float  # radius of the circle on which the balls' centres run [mm]
    eccentricity: float  # eccentricity e [mm]
    balls: int  # number of balls
    ball_radii: tuple[float, ...]  # radii of the balls [mm]
    motor: bool  # True if there is a motor torque to plot
    sensors: tuple[str, ...]  # names of sensors with readings to plot
    tilts: bool  # True if the deck moves in space
    explanation: Explanation  # quantities that explain the run
    top: TopView  # drawing from above
    space: Space  # drawing in space
    curves: Curves  # curves that are computed from the channels

    @classmethod
    def of(cls, description: Mapping[str, Any]) -> Drawing:
        """Create a drawing from the description of a recording.

        Raises
        ------
        RecordingError
            A value of the description is missing or invalid.
        """
        try:
            race_radius, balls = 1e3 * float(description["race_radius"]), int(description["balls"])
            eccentricity = 1e3 * float(description["eccentricity"])
            radii = description.get("ball_radii")
            if radii is None:
                radii = [1e-3 * ball_radius(race_radius, balls)] * balls
            ball_radii = tuple(1e3 * float(radius) for radius in radii)
            effects = description.get("effects") or ()
            motor, sensors = "motor" in effects, tuple(description.get("sensors") or ())
            deck, explanation = description.get("deck"), Explanation.of(description, balls)
            arrows = Arrows.of(explanation, race_radius)
            motion = eccentricity if explanation.motion is None else 1e3 * explanation.motion
            space = Space.of(deck, race_radius, ball_radii, motion, arrows)
        except (KeyError, TypeError, ValueError) as error:
            raise RecordingError(
                "the description of a recording needs numbers for race_radius [m], "
                "eccentricity [m] and balls, a list of numbers, or None, for ball_radii [m], and "
                "lists of names, or None, for effects and sensors, for a deck in space the section "
                "deck with mounts (places), race_heights, ball_heights and rotor_height [m], and "
                f"the entries of ab_sim.drive.description.explain: {error!r}"
            ) from error
        if len(ball_radii) != balls:
            raise RecordingError(
                f"the description of a recording gives {len(ball_radii)} ball_radii for {balls} "
                "balls; give one per ball, or None"
            )
        if len(space.ball_heights) != balls:
            raise RecordingError(
                f"the description of a recording gives {len(space.ball_heights)} ball_heights for "
                f"{balls} balls; give one per ball"
            )
        tilts, balance = deck is not None, explanation.balance
        top = TopView(race_radius, ball_radii, arrows, balance)
        curves = Curves(balls, eccentricity, tilts, explanation)
        return cls(
            race_radius, eccentricity, balls, ball_radii, motor, sensors, tilts, explanation, top,
            space, curves,
        )  # fmt: skip

    @property
    def needs(self) -> tuple[str, ...]:
        """Channels that the drawing needs, except the balls' angles."""
        return ("angle", "x", "y", *(("z", "qw", "qx", "qy", "qz") if self.tilts else ()))

    def scenery(self) -> Parts:
        """Yield the parts of the drawing that do not change, which are logged once."""
        yield from self.top.scenery()
        yield from self.space.scenery()


def description_text(description: Mapping[str, Any]) -> str:
    """Return the description of a run as Markdown with a block of JSON, for `open_recording`.

    Raises
    ------
    RecordingError
        The description is not JSON-able.
    """
    try:
        text = json.dumps(dict(description), indent=2)
    except (TypeError, ValueError) as error:
        raise RecordingError(f"the description of a recording is not JSON: {error}") from error
    return f"Complete description of this run.\n\n```json\n{text}\n```\n"
