"""Drawing of the drive from above, to scale, in mm.

In Rerun's 2-D views, y points downwards. The drawing negates y and all angles, so that on the
screen y points upwards and angles increase anticlockwise.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from ab_sim.base.palette import BALANCED, GREY, UNBALANCE, ball_colour
from ab_sim.drive.balance import Balance
from ab_sim.record.recording.layout import Array
from ab_sim.record.recording.overlapping_balls import shrunk
from ab_sim.record.recording.vectors import Arrows

Parts = Iterator[tuple[str, Any]]  # entities and their data

ROTOR = "/above/rotor"
"""Entity of the rotor. Its name sorts before that of the samples, so that Rerun draws the curves of
the samples on top of those of this entity."""
_SIDE = 1.35
"""Half the width of the picture, relative to the race's radius."""
_TOP, _BOTTOM = -1.55, 1.8
"""Upper and lower edge of the picture, with room for labels."""
_CORNERS = np.array([[-1.15, -1.5], [1.15, -1.5], [-1.15, 1.3], [1.15, 1.3]])
"""Positions of the legend's points, relative to the race's radius; labels are below them."""


@dataclass(frozen=True)
class TopView:
    """Drawing of a drive from above."""

    race: float
    """Radius of the circle on which the balls' centres run [mm]."""
    radii: tuple[float, ...]
    """Radii of the balls [mm]."""
    arrows: Arrows | None
    balance: Balance | None

    def scenery(self) -> Parts:
        """Yield the parts of the drawing that do not change, which are logged once."""
        r, widest = self.race, max(self.radii, default=0.0)
        c, mark = 0.1 * r, 0.88 * r
        cross = [[[-c, 0.0], [c, 0.0]], [[0.0, -c], [0.0, c]]]
        yield "/above/rest", rr.LineStrips2D(cross, colors=GREY, radii=0.006 * r)
        yield f"{ROTOR}/race", _rings([0.0], [0.0], [r + widest], GREY, 0.012 * r)
        unbalance = rr.Points2D([[mark, 0]], colors=UNBALANCE, radii=0.05 * r)
        yield f"{ROTOR}/unbalance", unbalance
        if self.radii:
            colors = [ball_colour(ball) for ball in range(len(self.radii))]
            yield ROTOR, rr.Points2D.from_fields(colors=colors)
        if self.balance is not None:
            angles = np.array(self.balance.angles)
            yield (
                f"{ROTOR}/balanced",
                _rings(
                    r * np.cos(angles),
                    -r * np.sin(angles),
                    1.25 * np.array(self.radii),
                    BALANCED,
                    0.014 * r,
                ),
            )
        if self.arrows is not None:
            yield (
                ROTOR,
                rr.Arrows2D.from_fields(colors=self.arrows.colors, radii=0.018 * r),
            )
            yield f"{ROTOR}/legend", self._legend(self.arrows)

    def frames(self, angle: Array, place: Array, balls: Array) -> list[Any]:
        """Return the columns of the rotor, one row per frame.

        Args:
            angle: angle of the spindle [rad], shape (rows,).
            place: displacement of the deck [mm], shape (rows, 2), or (rows, 3) in space.
            balls: angles of the balls [rad], shape (rows, balls).
        """
        rows, zero = len(angle), np.zeros_like(angle)
        shaft = np.column_stack([place[:, 0], -place[:, 1], zero])
        half = -0.5 * np.remainder(angle, 2 * np.pi)
        spun = np.column_stack([zero, zero, np.sin(half), np.cos(half)])
        rotor = [*rr.Transform3D.columns(translation=shaft, quaternion=spun)]
        if self.radii:
            places = self.race * np.stack([np.cos(balls), -np.sin(balls)], axis=-1)
            drawn = shrunk(balls, self.race, self.radii)
            points = rr.Points2D.columns(positions=places.reshape(-1, 2), radii=drawn.ravel())
            rotor += points.partition(np.full(rows, len(self.radii)))
        if self.arrows is not None:
            begin, way = self.arrows.drawn(balls)
            arrows = rr.Arrows2D.columns(origins=_flat(begin), vectors=_flat(way))
            rotor += arrows.partition(np.full(rows, begin.shape[1]))
        return rotor

    def _legend(self, arrows: Arrows) -> Any:
        """Return the legend of arrows and rings, in the corners, where it covers no ball."""
        labels, colors = list(arrows.labels), list(arrows.colors)
        if self.balance is not None:
            labels.append("balanced" if self.balance.residual == 0.0 else "best place")
            colors.append(BALANCED)
        places = self.race * _CORNERS[: len(labels)]
        return rr.Points2D(
            places, colors=colors, radii=0.03 * self.race, labels=labels, show_labels=True
        )

    def view(self) -> rrb.View:
        """Return the view of the drive from above."""
        sides = np.array([-_SIDE, _SIDE]) * self.race
        height = np.array([_TOP, _BOTTOM]) * self.race
        return rrb.Spatial2DView(
            name="Top view",
            origin=ROTOR,
            contents=["$origin/**", "/above/rest"],
            visual_bounds=rrb.VisualBounds2D(x_range=sides, y_range=height),
        )


def _flat(points: Array) -> Array:
    return np.column_stack([points.real.ravel(), -points.imag.ravel()])


def _rings(x: Any, y: Any, radii: Any, color: Any, line: float) -> Any:
    turn = np.linspace(0, 2 * np.pi, 121)
    circle = np.column_stack([np.cos(turn), np.sin(turn)])
    rings = [
        np.array([px, py]) + radius * circle for px, py, radius in zip(x, y, radii, strict=True)
    ]
    return rr.LineStrips2D(rings, colors=color, radii=line)
