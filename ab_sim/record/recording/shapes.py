"""Drawings of the drive in mm: from above to scale, and in space.

In Rerun's 2-D views, y points downwards. The drawing from above negates y and all angles, so that
on the screen y points upwards and angles increase anticlockwise.

Displacement and tilt are hundreds of times smaller than the deck, so the drawing in space
exaggerates both by one factor, which the text next to the drawing states. To first order, the
displacement of every point of the deck is multiplied by this factor. Spindle and balls turn by
their true angles.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from ab_sim.base.palette import BALANCED, GREY, RESIDUAL, RESULTANT, UNBALANCE, Colour, ball_colour
from ab_sim.drive.closed_forms import Balance, resultant
from ab_sim.drive.urdf import DISC, MARK, MARK_PLACE, PLATE
from ab_sim.record.recording.explanation import Explanation
from ab_sim.record.recording.layout import Array

_REACH = 0.62
"""Drawn length of the longest arrow, relative to the race's radius.

The longest arrow is the rotor's unbalance, or the vector sum of all balls at one place.
"""


class Arrows(NamedTuple):
    """Arrows of a drawing: M0 e, sum m_i R exp(i theta_i), and their sum."""

    unbalance: float
    """Unbalance M0 e [kg m]."""
    moments: Array
    """Moments m_i R of the balls [kg m], shape (balls,)."""
    scale: float
    """Drawn length [mm] per unbalance [kg m]."""

    @classmethod
    def of(cls, explanation: Explanation, race_radius: float) -> Arrows | None:
        """Create the arrows for a race's radius [mm]; None without an unbalance."""
        if not explanation.vectors:
            return None
        assert explanation.unbalance is not None
        longest = max(explanation.unbalance, float(explanation.moments.sum()))
        return cls(explanation.unbalance, explanation.moments, _REACH * race_radius / longest)

    @property
    def labels(self) -> list[str]:
        """Names of the arrows."""
        return ["unbalance", "balls", "residual"] if len(self.moments) else ["unbalance"]

    @property
    def colors(self) -> list[Colour]:
        """Colours of the arrows."""
        return [UNBALANCE, RESULTANT, RESIDUAL][: len(self.labels)]

    def drawn(self, angles: Array) -> tuple[Array, Array]:
        """Return origins and vectors of the arrows on the rotor's axes.

        Parameters
        ----------
        angles
            Angles of the balls from the unbalance [rad], shape (rows, balls).

        Returns
        -------
        tuple[Array, Array]
            Two complex arrays of shape (rows, arrows) [mm].
        """
        rotor = np.full(len(angles), self.scale * self.unbalance, dtype=complex)
        none = np.zeros_like(rotor)
        if not len(self.moments):
            return none[:, None], rotor[:, None]
        balls = self.scale * resultant(self.moments, angles)
        return np.column_stack([none, rotor, none]), np.column_stack([rotor, balls, rotor + balls])


def _shrunk(angles: Array, race_radius: float, radii: tuple[float, ...]) -> Array:
    """Return radii to draw balls with, such that balls at the same place are all visible.

    A ball that covers an earlier one is drawn smaller, so that the edge of the latter remains
    visible.

    Parameters
    ----------
    angles
        Angles of the balls [rad], shape (rows, balls).
    race_radius
        Radius of the circle of the balls' centres.
    radii
        Radii of the balls, in the unit of ``race_radius``.

    Returns
    -------
    Array
        Radii in this unit, shape (rows, balls).
    """
    drawn = np.tile(radii, (len(angles), 1))
    for ball in range(1, len(radii)):
        inside = np.minimum(radii[ball], 0.62 * drawn[:, :ball])
        cover = _cover(angles, ball, race_radius, radii[ball])
        drawn[:, ball] = (radii[ball] + cover * (inside - radii[ball])).min(axis=1)
    return drawn


def stacked(angles: Array, race_radius: float, radii: tuple[float, ...]) -> Array:
    """Return the heights at which balls are drawn above the race, shape (rows, balls).

    A ball inside another would be invisible in space, so a ball that covers an earlier one is drawn
    on top of it. The arguments are those of `_shrunk`.
    """
    heights = np.zeros(angles.shape)
    for ball in range(1, len(radii)):
        above = heights[:, :ball] + np.array(radii[:ball]) + radii[ball]
        heights[:, ball] = (_cover(angles, ball, race_radius, radii[ball]) * above).max(axis=1)
    return heights


def _cover(angles: Array, ball: int, race_radius: float, radius: float) -> Array:
    """Return the overlap of a ball with each earlier one, shape (rows, earlier balls).

    It is 1 at the same place, and 0 at a distance of the ball's ``radius`` or more.
    """
    chord = 2.0 * race_radius * np.abs(np.sin(0.5 * (angles[:, :ball] - angles[:, ball, None])))
    return np.asarray(np.clip(1.0 - chord / radius, 0.0, 1.0))


Parts = Iterator[tuple[str, Any]]  # entities and their data

ROTOR = "/above/rotor"
"""Entity of the rotor. Its name sorts before that of the samples, so that Rerun draws the curves of
the samples on top of those of this entity."""
_SIDE = 1.35
"""Half the width of the picture, relative to the race's radius."""
_TOP, _BOTTOM = -1.55, 1.8
"""Upper and lower edge of the picture, with room for labels, relative to the race's radius."""
_CORNERS = np.array([[-1.15, -1.5], [1.15, -1.5], [-1.15, 1.3], [1.15, 1.3]])
"""Positions of the legend's points, relative to the race's radius; labels are below them."""


@dataclass(frozen=True)
class TopView:
    """Drawing of a drive from above."""

    race_radius: float
    """Radius of the circle on which the balls' centres run [mm]."""
    ball_radii: tuple[float, ...]
    """Radii of the balls [mm]."""
    arrows: Arrows | None
    """Arrows of unbalances; None: not drawn."""
    balance: Balance | None
    """Positions of the balls that are marked by rings; None: not drawn."""

    def scenery(self) -> Parts:
        """Yield the parts of the drawing that do not change, which are logged once."""
        r, widest = self.race_radius, max(self.ball_radii, default=0.0)
        c, mark = 0.1 * r, 0.88 * r
        cross = [[[-c, 0.0], [c, 0.0]], [[0.0, -c], [0.0, c]]]
        yield "/above/rest", rr.LineStrips2D(cross, colors=GREY, radii=0.006 * r)
        yield f"{ROTOR}/race", _rings([0.0], [0.0], [r + widest], GREY, 0.012 * r)
        unbalance = rr.Points2D([[mark, 0]], colors=UNBALANCE, radii=0.05 * r)
        yield f"{ROTOR}/unbalance", unbalance
        if self.ball_radii:
            colors = [ball_colour(ball) for ball in range(len(self.ball_radii))]
            yield ROTOR, rr.Points2D.from_fields(colors=colors)
        if self.balance is not None:
            angles = np.array(self.balance.angles)
            yield (
                f"{ROTOR}/balanced",
                _rings(
                    r * np.cos(angles),
                    -r * np.sin(angles),
                    1.25 * np.array(self.ball_radii),
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
        """Return Rerun's columns of the rotor, one row per frame.

        Parameters
        ----------
        angle
            Angle of the spindle [rad], shape (rows,).
        place
            Displacement of the deck [mm], shape (rows, 2), or (rows, 3) in space.
        balls
            Angles of the balls [rad], shape (rows, balls).
        """
        rows, zero = len(angle), np.zeros_like(angle)
        shaft = np.column_stack([place[:, 0], -place[:, 1], zero])
        half = -0.5 * np.remainder(angle, 2 * np.pi)
        spun = np.column_stack([zero, zero, np.sin(half), np.cos(half)])
        rotor = [*rr.Transform3D.columns(translation=shaft, quaternion=spun)]
        if self.ball_radii:
            places = self.race_radius * np.stack([np.cos(balls), -np.sin(balls)], axis=-1)
            drawn = _shrunk(balls, self.race_radius, self.ball_radii)
            points = rr.Points2D.columns(positions=places.reshape(-1, 2), radii=drawn.ravel())
            rotor += points.partition(np.full(rows, len(self.ball_radii)))
        if self.arrows is not None:
            begin, way = self.arrows.drawn(balls)
            arrows = rr.Arrows2D.columns(origins=_flat(begin), vectors=_flat(way))
            rotor += arrows.partition(np.full(rows, begin.shape[1]))
        return rotor

    def _legend(self, arrows: Arrows) -> Any:
        """Return labels of arrows and rings as legend, in the corners, where no ball is covered."""
        labels, colors = list(arrows.labels), list(arrows.colors)
        if self.balance is not None:
            labels.append("balanced" if self.balance.residual == 0.0 else "best place")
            colors.append(BALANCED)
        places = self.race_radius * _CORNERS[: len(labels)]
        return rr.Points2D(
            places, colors=colors, radii=0.03 * self.race_radius, labels=labels, show_labels=True
        )

    def view(self) -> rrb.View:
        """Return the view of the drive from above."""
        sides = np.array([-_SIDE, _SIDE]) * self.race_radius
        height = np.array([_TOP, _BOTTOM]) * self.race_radius
        return rrb.Spatial2DView(
            name="Top view",
            origin=ROTOR,
            contents=["$origin/**", "/above/rest"],
            visual_bounds=rrb.VisualBounds2D(x_range=sides, y_range=height),
        )


def _flat(points: Array) -> Array:
    """Return complex points as rows (x, -y): in Rerun's 2-D views, y points downwards."""
    return np.column_stack([points.real.ravel(), -points.imag.ravel()])


def _rings(x: Any, y: Any, radii: Any, color: Any, line: float) -> Any:
    """Return rings around points [mm] with a colour and a radius ``line`` of the lines [mm]."""
    turn = np.linspace(0, 2 * np.pi, 121)
    circle = np.column_stack([np.cos(turn), np.sin(turn)])
    rings = [
        np.array([px, py]) + radius * circle for px, py, radius in zip(x, y, radii, strict=True)
    ]
    return rr.LineStrips2D(rings, colors=color, radii=line)


_DECK, _SPRING = (90, 140, 190), (150, 150, 90)
_GLASS = (75, 80, 90)
_SHOWN = 0.04
"""Drawn size of the deck's motion due to the unbalance alone, relative to the deck's size."""


@dataclass(frozen=True)
class Space:
    """Drawing of a drive in space."""

    mounts: Array
    """Positions of the mounts on deck axes [mm], shape (mounts, 3)."""
    race_heights: tuple[float, ...]
    """Heights of the races along the shaft from the deck's origin [mm]."""
    ball_heights: tuple[float, ...]
    """Height of each ball's race [mm]."""
    rotor_height: float
    """Height of the rotor's disc and unbalance [mm]."""
    race_radius: float
    """Radius of the circle of the balls' centres [mm]."""
    ball_radii: tuple[float, ...]
    """Radii of the balls [mm]."""
    factor: float
    """Factor by which displacement and tilt are exaggerated."""
    tilts: bool
    """True if the deck moves in space, and not only in the plane of the disc."""
    arrows: Arrows | None
    """Arrows of unbalances; None: not drawn."""

    @classmethod
    def of(
        cls,
        deck: Mapping[str, Any] | None,
        race_radius: float,
        ball_radii: tuple[float, ...],
        motion: float,
        arrows: Arrows | None,
    ) -> Space:
        """Create the drawing from the section ``deck`` of a description.

        Parameters
        ----------
        deck
            Section of the description, lengths in m; None for a deck in the plane of the disc,
            which is drawn as a square.
        race_radius
            Radius of the circle of the balls' centres [mm].
        ball_radii
            Radii of the balls [mm].
        motion
            Size of the deck's motion [mm].
        arrows
            Arrows to draw.

        Raises
        ------
        KeyError, TypeError, ValueError
            A value is missing or invalid.
        """
        if deck is None:
            flat = dict.fromkeys(("race_heights",), [0.0]) | {"rotor_height": 0.0}
            corner = 1e-3 * PLATE * race_radius
            mounts = [[x, y, 0.0] for x in (-corner, corner) for y in (-corner, corner)]
            sections: Mapping[str, Any] = flat | {
                "mounts": mounts,
                "ball_heights": [0.0] * len(ball_radii),
            }
        else:
            sections = deck
        points = 1e3 * np.array(sections["mounts"], dtype=float).reshape(-1, 3)
        size = max([race_radius, *np.hypot(points[:, 0], points[:, 1])])
        return cls(
            points,
            tuple(1e3 * float(height) for height in sections["race_heights"]),
            tuple(1e3 * float(height) for height in sections["ball_heights"]),
            1e3 * float(sections["rotor_height"]),
            race_radius,
            ball_radii,
            _round_down(_SHOWN * size / motion) if motion > 0 else 1.0,
            deck is not None,
            arrows,
        )

    def scenery(self) -> Parts:
        """Yield the parts of the drawing that do not change, which are logged once."""
        r, (low, high) = self.race_radius, self._plate()
        plate = _rectangle(low, high)
        line = 0.01 * r
        axis = [0, 0, -0.5 * r], [0, 0, 1.2 * r]
        yield "/space", rr.ViewCoordinates.RIGHT_HAND_Z_UP
        yield "/space/rest/plate", rr.LineStrips3D([plate], colors=GREY, radii=0.5 * line)
        yield "/space/rest/axis", rr.LineStrips3D([axis], colors=GREY, radii=0.5 * line)
        yield "/space/rest/housing", rr.Points3D(self._anchors(), colors=GREY, radii=0.05 * r)
        yield "/space/deck", rr.LineStrips3D.from_fields(colors=_SPRING, radii=1.5 * line)
        yield "/space/deck/plate", rr.LineStrips3D([plate], colors=_DECK, radii=1.5 * line)
        yield "/space/deck/mounts", rr.Points3D(self.mounts, colors=_SPRING, radii=0.05 * r)
        yield "/space/deck/axis", rr.LineStrips3D([axis], colors=_DECK, radii=line)
        for i, height in enumerate(self.race_heights):
            ring = _circle(r + max(self.ball_radii, default=0.0), height)
            yield f"/space/deck/races/{i}", rr.LineStrips3D([ring], colors=GREY, radii=1.5 * line)
        disc = _disc(DISC * r, self.rotor_height - max(self.ball_radii, default=0.02 * r))
        yield "/space/deck/rotor/disc", disc
        heavy = [[MARK_PLACE * r, 0.0, self.rotor_height]]
        yield (
            "/space/deck/rotor/unbalance",
            rr.Points3D(heavy, colors=UNBALANCE, radii=MARK * r),
        )
        if self.ball_heights:
            colors = [ball_colour(ball) for ball in range(len(self.ball_radii))]
            yield "/space/deck/rotor", rr.Points3D.from_fields(colors=colors, radii=self.ball_radii)
        if self.arrows is not None:
            yield (
                "/space/deck/rotor",
                rr.Arrows3D.from_fields(colors=self.arrows.colors, radii=2.5 * line),
            )

    def frames(self, angle: Array, place: Array, turn: Array, balls: Array) -> Parts:
        """Yield Rerun's columns of moving parts by entity, one row per frame.

        Parameters
        ----------
        angle
            Angle of the spindle [rad], shape (rows,).
        place
            Displacement of the deck's centre [m], shape (rows, 2), or (rows, 3) in space.
        turn
            Attitude of the deck as quaternions (w, x, y, z), shape (rows, 4).
        balls
            Angles of the balls from the unbalance [rad], shape (rows, balls).
        """
        rows, turned = len(angle), _more(turn, self.factor)
        moved = np.zeros((rows, 3))
        moved[:, : place.shape[1]] = 1e3 * self.factor * place
        deck = [*rr.Transform3D.columns(translation=moved, quaternion=np.roll(turned, -1, axis=1))]
        if len(self.mounts):
            back = turned * [1.0, -1.0, -1.0, -1.0]
            ends = _rotated(back[:, None, :], self._anchors() - moved[:, None, :])  # on deck axes
            starts = np.broadcast_to(self.mounts, ends.shape)
            strips = np.stack([starts, ends], axis=2).reshape(-1, 2, 3)
            springs = rr.LineStrips3D.columns(strips=strips.astype(np.float32))
            deck += springs.partition(np.full(rows, len(self.mounts)))
        yield "/space/deck", deck
        half = 0.5 * np.remainder(angle, 2 * np.pi)
        zero = np.zeros_like(half)
        spun = np.column_stack([zero, zero, np.sin(half), np.cos(half)])
        rotor = [*rr.Transform3D.columns(quaternion=spun)]
        if self.ball_heights:
            heights = self.ball_heights + self._stacked(balls)
            places = np.stack(
                [self.race_radius * np.cos(balls), self.race_radius * np.sin(balls), heights],
                axis=-1,
            )
            points = rr.Points3D.columns(positions=places.reshape(-1, 3))
            rotor += points.partition(np.full(rows, balls.shape[1]))
        if self.arrows is not None:
            begin, way = self.arrows.drawn(balls)
            above = self.rotor_height + 0.03 * self.race_radius
            arrows = rr.Arrows3D.columns(
                origins=_flat_in_space(begin, above), vectors=_flat_in_space(way, 0.0)
            )
            rotor += arrows.partition(np.full(rows, begin.shape[1]))
        yield "/space/deck/rotor", rotor

    def view(self) -> rrb.View:
        """Return the 3-D view."""
        low, high = self._plate()
        middle, size = 0.5 * (low + high), float(np.hypot(*(high - low)[:2]))
        eye = middle + size * np.array([0.33, -0.85, 0.6])
        return rrb.Spatial3DView(
            name="In space",
            origin="/space",
            line_grid=False,
            eye_controls=rrb.EyeControls3D(
                kind=rrb.Eye3DKind.Orbital, position=eye, look_target=middle, eye_up=(0, 0, 1)
            ),
        )

    def _stacked(self, balls: Array) -> Array:
        """Return the lift of balls [mm] that overlap in one race; 0 with several races."""
        if len({*self.ball_heights}) > 1:
            return np.zeros_like(balls)
        return stacked(balls, self.race_radius, self.ball_radii)

    def _plate(self) -> tuple[Array, Array]:
        """Return two opposite corners of the drawn plate, which spans the mounts and the race."""
        ring = self.race_radius * np.array([[-1.0, -1.0, 0.0], [1.0, 1.0, 0.0]])
        points = np.vstack([self.mounts, ring])
        low, high = points.min(axis=0), points.max(axis=0)
        low[2] = high[2] = self.mounts[:, 2].mean() if len(self.mounts) else 0.0
        return low, high

    def _anchors(self) -> Array:
        """Return the mounts' attachments to the housing, drawn below the deck for visibility."""
        return self.mounts - [0.0, 0.0, 0.6 * self.race_radius]


def _more(turn: Array, factor: float) -> Array:
    """Return quaternions (w, x, y, z), shape (rows, 4), with angles multiplied by a factor."""
    turn = turn * np.where(turn[:, :1] < 0, -1.0, 1.0)
    sine = np.linalg.norm(turn[:, 1:], axis=1, keepdims=True)
    half = factor * np.arctan2(sine, turn[:, :1])
    axis = np.divide(turn[:, 1:], sine, out=np.zeros_like(turn[:, 1:]), where=sine > 0)
    return np.hstack([np.cos(half), np.sin(half) * axis])


def _rotated(turn: Array, points: Array) -> Array:
    """Return points, shape (..., 3), rotated by unit quaternions (w, x, y, z), shape (..., 4)."""
    axis = turn[..., 1:]
    across = np.cross(axis, points)
    return np.asarray(points + 2.0 * (turn[..., :1] * across + np.cross(axis, across)))


def _round_down(factor: float) -> float:
    """Round down to 1, 2 or 5 times a power of ten, at least 1."""
    if factor < 1.0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(factor))
    return float(power * max(step for step in (1, 2, 5) if step * power <= factor))


def _rectangle(low: Array, high: Array) -> Array:
    """Return the corners of a horizontal rectangle as a closed line, from two opposite ones."""
    x, y, z = low[0], low[1], low[2]
    return np.array([[x, y, z], [high[0], y, z], [high[0], high[1], z], [x, high[1], z], [x, y, z]])


def _circle(radius: float, height: float) -> Array:
    """Return the points of a horizontal circle as a closed line, shape (points, 3)."""
    turn = np.linspace(0, 2 * np.pi, 121)
    return np.column_stack(
        [radius * np.cos(turn), radius * np.sin(turn), np.full_like(turn, height)]
    )


def _disc(radius: float, height: float) -> Any:
    """Return a mesh of a horizontal disc [mm] that is visible from above and below."""
    rim = _circle(radius, height)[:-1]
    count = len(rim)
    corners = np.vstack([rim, [[0.0, 0.0, height]]])
    near = np.arange(count)
    faces = np.column_stack([near, (near + 1) % count, np.full(count, count)])
    return rr.Mesh3D(
        vertex_positions=corners,
        triangle_indices=np.vstack([faces, faces[:, ::-1]]),
        albedo_factor=_GLASS,
    )


def _flat_in_space(points: Array, height: float) -> Array:
    """Return complex points on the rotor's axes as points in space, at one height."""
    flat = points.ravel()
    return np.column_stack([flat.real, flat.imag, np.full(len(flat), height)])
