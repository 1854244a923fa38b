"""The picture of a deck that moves and tilts in space, in mm.

Displacement and tilt are hundreds of times smaller than the deck, so the drawing exaggerates both
by one factor, which its title says: the displacement of every point of the deck then is, to first
order, so many times what it was. The spindle and the balls turn as they do.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from ab_sim.recording.layout import Array

Parts = Iterator[tuple[str, Any]]

_DECK, _REST, _SPRING, _RACE, _RED = (
    (110, 150, 190),
    (90, 90, 90),
    (190, 190, 120),
    (190, 190, 190),
    (235, 70, 60),
)
_SHOWN = 0.04
"""What the unbalance alone does to the deck is drawn about so large, as a share of its size."""


@dataclass(frozen=True)
class Space:
    """What is drawn of a deck in space, and how."""

    mounts: Array
    """Where they hold the deck, on its axes [mm], shape (mounts, 3)."""
    race_heights: tuple[float, ...]
    ball_heights: tuple[float, ...]
    rotor_height: float
    """mm."""
    race: float
    """Radius of the circle of the balls' centres [mm]."""
    factor: float
    """By which displacement and tilt are exaggerated."""

    @classmethod
    def of(cls, deck: Mapping[str, Any], race: float) -> Space:
        """Take from a description's ``deck`` what is drawn.

        Raises:
            KeyError, TypeError, ValueError: it is not there.
        """
        mounts = 1e3 * np.array(deck["mounts"], dtype=float).reshape(-1, 3)
        size = max([race, *np.hypot(mounts[:, 0], mounts[:, 1])])
        motion = 1e3 * float(deck["motion"])
        return cls(
            mounts,
            tuple(1e3 * float(height) for height in deck["race_heights"]),
            tuple(1e3 * float(height) for height in deck["ball_heights"]),
            1e3 * float(deck["rotor_height"]),
            race,
            _round_down(_SHOWN * size / motion) if motion > 0 else 1.0,
        )

    @property
    def title(self) -> str:
        """Of the view."""
        return f"Deck in space: displacement and tilt drawn {self.factor:g} times as large"

    def scenery(self, colors: Sequence[Any], radii: Sequence[float]) -> Parts:
        """What stays: archetypes, logged once.

        Args:
            colors: of the balls.
            radii: of the balls [mm].
        """
        r, (low, high) = self.race, self._plate()
        plate = _rectangle(low, high)
        line, disc = 0.01 * r, 1.3 * r
        yield "/space", rr.ViewCoordinates.RIGHT_HAND_Z_UP
        yield "/space/rest/plate", rr.LineStrips3D([plate], colors=_REST, radii=0.5 * line)
        yield "/space/rest/axis", _line([0, 0, -0.5 * r], [0, 0, 1.2 * r], _REST, 0.5 * line)
        yield "/space/rest/housing", rr.Points3D(self._anchors(), colors=_REST, radii=0.05 * r)
        yield "/space/springs", rr.LineStrips3D.from_fields(colors=_SPRING, radii=1.5 * line)
        yield "/space/deck/plate", rr.LineStrips3D([plate], colors=_DECK, radii=1.5 * line)
        yield (
            "/space/deck/mounts",
            rr.Points3D(self.mounts, colors=_SPRING, radii=0.05 * r),
        )
        yield "/space/deck/axis", _line([0, 0, -0.5 * r], [0, 0, 1.2 * r], _DECK, line)
        for i, height in enumerate(self.race_heights):
            ring = _circle(r + max(radii, default=0.0), height)
            yield (
                f"/space/deck/races/{i}",
                rr.LineStrips3D([ring], colors=_RACE, radii=line),
            )
        yield (
            "/space/deck/rotor/disc",
            rr.LineStrips3D([_circle(disc, self.rotor_height)], colors=_REST, radii=line),
        )
        heavy = [[0.75 * r, 0.0, self.rotor_height]]
        yield (
            "/space/deck/rotor/arm",
            rr.Arrows3D(
                origins=[[0.0, 0.0, self.rotor_height]],
                vectors=[[0.75 * r, 0.0, 0.0]],
                colors=_RED,
                radii=1.5 * line,
            ),
        )
        yield (
            "/space/deck/rotor/unbalance",
            rr.Points3D(heavy, colors=_RED, radii=0.06 * r, labels="unbalance"),
        )
        if self.ball_heights:
            yield "/space/deck/rotor/balls", rr.Points3D.from_fields(colors=colors, radii=radii)

    def frames(self, angle: Array, place: Array, turn: Array, balls: Array) -> Parts:
        """What moves: columns, one row per sample.

        Args:
            angle: of the spindle [rad], shape (rows,).
            place: of C [m], shape (rows, 3).
            turn: quaternions (w, x, y, z), shape (rows, 4).
            balls: their angles from the unbalance [rad], shape (rows, balls).
        """
        rows, moved, turned = len(angle), 1e3 * self.factor * place, _more(turn, self.factor)
        yield (
            "/space/deck",
            rr.Transform3D.columns(translation=moved, quaternion=np.roll(turned, -1, axis=1)),
        )
        half = 0.5 * np.remainder(angle, 2 * np.pi)
        zero = np.zeros_like(half)
        spun = np.column_stack([zero, zero, np.sin(half), np.cos(half)])
        yield "/space/deck/rotor", rr.Transform3D.columns(quaternion=spun)
        if len(self.mounts):
            ends = moved[:, None, :] + _rotated(turned[:, None, :], self.mounts)
            starts = np.broadcast_to(self._anchors(), ends.shape)
            strips = np.stack([starts, ends], axis=2).reshape(-1, 2, 3)
            springs = rr.LineStrips3D.columns(strips=strips.astype(np.float32))
            yield "/space/springs", springs.partition(np.full(rows, len(self.mounts)))
        if self.ball_heights:
            heights = np.broadcast_to(self.ball_heights, balls.shape)
            places = np.stack(
                [self.race * np.cos(balls), self.race * np.sin(balls), heights], axis=-1
            )
            points = rr.Points3D.columns(positions=places.reshape(-1, 3))
            yield "/space/deck/rotor/balls", points.partition(np.full(rows, balls.shape[1]))

    def view(self) -> rrb.View:
        """The 3-D view."""
        low, high = self._plate()
        middle, size = 0.5 * (low + high), float(np.hypot(*(high - low)[:2]))
        eye = middle + size * np.array([0.4, -1.0, 0.7])
        return rrb.Spatial3DView(
            name=self.title,
            origin="/space",
            line_grid=False,
            eye_controls=rrb.EyeControls3D(
                kind=rrb.Eye3DKind.Orbital, position=eye, look_target=middle, eye_up=(0, 0, 1)
            ),
        )

    def _plate(self) -> tuple[Array, Array]:
        """Corners of the rectangle that holds mounts and race, at the mounts' height."""
        ring = self.race * np.array([[-1.0, -1.0, 0.0], [1.0, 1.0, 0.0]])
        points = np.vstack([self.mounts, ring])
        low, high = points.min(axis=0), points.max(axis=0)
        low[2] = high[2] = self.mounts[:, 2].mean() if len(self.mounts) else 0.0
        return low, high

    def _anchors(self) -> Array:
        """Where the mounts hold on to the housing: below, for them to be seen."""
        return self.mounts - [0.0, 0.0, 0.6 * self.race]


def _more(turn: Array, factor: float) -> Array:
    """The same turns about the same axes, so many times as far."""
    turn = turn * np.where(turn[:, :1] < 0, -1.0, 1.0)
    sine = np.linalg.norm(turn[:, 1:], axis=1, keepdims=True)
    half = factor * np.arctan2(sine, turn[:, :1])
    axis = np.divide(turn[:, 1:], sine, out=np.zeros_like(turn[:, 1:]), where=sine > 0)
    return np.hstack([np.cos(half), np.sin(half) * axis])


def _rotated(turn: Array, points: Array) -> Array:
    """Points turned by unit quaternions (w, x, y, z)."""
    axis = turn[..., 1:]
    across = np.cross(axis, points)
    return np.asarray(points + 2.0 * (turn[..., :1] * across + np.cross(axis, across)))


def _round_down(factor: float) -> float:
    """To 1, 2 or 5 times a power of ten, and at least 1: a number that people can keep in mind."""
    if factor < 1.0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(factor))
    return float(power * max(step for step in (1, 2, 5) if step * power <= factor))


def _rectangle(low: Array, high: Array) -> Array:
    x, y, z = low[0], low[1], low[2]
    return np.array([[x, y, z], [high[0], y, z], [high[0], high[1], z], [x, high[1], z], [x, y, z]])


def _circle(radius: float, height: float) -> Array:
    turn = np.linspace(0, 2 * np.pi, 121)
    return np.column_stack(
        [radius * np.cos(turn), radius * np.sin(turn), np.full_like(turn, height)]
    )


def _line(start: list[float], end: list[float], color: Any, radius: float) -> Any:
    return rr.LineStrips3D([[start, end]], colors=color, radii=radius)
