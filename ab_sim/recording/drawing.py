"""The pictures: what is drawn, and how the viewer is laid out."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from ab_sim.drive.turns import tilt_of
from ab_sim.errors import RecordingError
from ab_sim.recording.layout import Array, scalar_columns, sensor_entity, size_entity
from ab_sim.recording.space import Space

Parts = Iterator[tuple[str, Any]]  # entities, each with what is sent there

_RED, _GREY, _WHITE, _GREEN = (235, 70, 60), (150, 150, 150), (235, 235, 235), (150, 220, 90)
_HUES = [(70, 150, 255), (255, 170, 40), (60, 210, 200), (200, 120, 255), (240, 230, 90)]
_HUES += [(255, 130, 180), (170, 140, 100), (120, 130, 255)]
_TITLES = {
    "real_time_factor": "Real-time factor [1]; 1 keeps up",
    "commands_received": "Commands received, speed, command [rad/s]",
}
# Rerun links the time axes of plots only once one of them is zoomed; until then each spans its own
# data. So every plot holds something of the whole run.
_BESIDE = {"real_time_factor": "/plot/real_time", "commands_received": "/spindle/speed"}
_RANGES = {"real_time_factor": (0.0, 1.25)}
_STYLES: dict[str, Any] = {
    "real_time_factor": rr.SeriesLines(names="measured", colors=_HUES[2], widths=3.0),
    "commands_received": rr.SeriesPoints(names="received", colors=_WHITE, marker_sizes=1.5),
}


@dataclass(frozen=True)
class Drawing:
    """The drive in pictures, to scale, in mm.

    Rerun's 2-D views have y downwards. The drawing negates y and all angles, so that on the
    screen y points upwards and angles grow anticlockwise.
    """

    race: float  # radius of the circle on which the balls' centres run
    eccentricity: float
    balls: int
    radii: tuple[float, ...]  # of the balls
    motor: bool = False  # whether there is a torque to plot
    sensors: tuple[str, ...] = ()  # whose readings there are to plot
    space: Space | None = None  # of a deck in space

    @classmethod
    def of(cls, description: Mapping[str, Any]) -> Drawing:
        """Take from a description what is drawn; RecordingError if it is not there."""
        try:
            race, balls = 1e3 * float(description["race_radius"]), int(description["balls"])
            eccentricity = 1e3 * float(description["eccentricity"])
            given = description.get("ball_radii")
            if given is None:
                given = [1e-3 * race * min(0.1, 2.5 / max(balls, 1))] * balls
            radii = tuple(1e3 * float(radius) for radius in given)
            effects = description.get("effects") or ()
            motor, sensors = "motor" in effects, tuple(description.get("sensors") or ())
            deck = description.get("deck")
            space = None if deck is None else Space.of(deck, race)
        except (KeyError, TypeError, ValueError) as error:
            raise RecordingError(
                "the description of a recording needs numbers for race_radius [m], "
                "eccentricity [m] and balls, a list of numbers, or None, for ball_radii [m], and "
                "lists of names, or None, for effects and sensors, and of a deck in space, as "
                "deck, mounts (places), race_heights, ball_heights, rotor_height and motion [m]: "
                f"{error!r}"
            ) from error
        if len(radii) != balls:
            raise RecordingError(
                f"the description of a recording gives {len(radii)} ball_radii for {balls} balls; "
                "give one per ball, or None"
            )
        if space is not None and len(space.ball_heights) != balls:
            raise RecordingError(
                f"the description of a recording gives {len(space.ball_heights)} ball_heights for "
                f"{balls} balls; give one per ball"
            )
        return cls(race, eccentricity, balls, radii, motor, sensors, space)

    def document(self, description: Mapping[str, Any]) -> str:
        """Write the description for people, with its JSON in a fence for `read_recording`."""
        try:
            text = json.dumps(dict(description), indent=2)
        except (TypeError, ValueError) as error:
            raise RecordingError(f"the description of a recording is not JSON: {error}") from error
        return (
            f"**{self.balls} balls on a race of radius {self.race:g} mm, "
            f"eccentricity e = {self.eccentricity:g} mm.**\n\nTop views, to scale: balls in the "
            "colours of the plot (one that covers another is drawn smaller), unbalance in red, a "
            "white cross where the shaft would rest, in green where its centre was in the last "
            f"50 ms.{self._in_space()}\n\n```json\n{text}\n```\n"
        )

    def _in_space(self) -> str:
        if self.space is None:
            return ""
        return (
            f"\n\nIn space, displacement and tilt {self.space.factor:g} times as large as they "
            "are: the deck in blue, in dark grey where its mounts are relaxed, yellow lines from "
            "the mounts to the housing; race or races, balls, disc (of a size of its own) and "
            "unbalance at their heights."
        )

    def scenery(self) -> Parts:
        """What stays: archetypes, logged once."""
        r, turn = self.race, np.linspace(0, 2 * np.pi, 121)
        wall_of_race = (r + max(self.radii, default=0.0)) * np.column_stack(
            [np.cos(turn), np.sin(turn)]
        )
        c, mark = 0.1 * r, 0.75 * r
        cross = [[[-c, 0.0], [c, 0.0]], [[0.0, -c], [0.0, c]]]
        arm = [[[0.0, 0.0], [mark, 0.0]]]
        yield "/top/rest", rr.LineStrips2D(cross, colors=_WHITE, radii=0.01 * r)
        yield "/top/shaft", rr.Points2D.from_fields(colors=_GREEN, radii=0.02 * r)
        yield "/top/rotor/race", rr.LineStrips2D([wall_of_race], colors=_GREY, radii=0.015 * r)
        yield "/top/rotor/arm", rr.LineStrips2D(arm, colors=_RED, radii=0.01 * r)
        yield (
            "/top/rotor/unbalance",
            rr.Points2D([[mark, 0]], colors=_RED, radii=0.06 * r, labels="unbalance"),
        )
        colors = [_HUES[ball % len(_HUES)] for ball in range(self.balls)]
        if self.space is not None:
            yield from self.space.scenery(colors, self.radii)
            yield "/plot/tilt", lines(["alpha", "beta", "gamma"])
        if self.balls:
            yield "/top/rotor/balls", rr.Points2D.from_fields(colors=colors)
            # Where curves coincide, the first ones show on both sides of the last ones.
            widths = np.linspace(4.0, 1.5, self.balls).tolist()
            yield "/plot/balls", lines([f"ball {ball}" for ball in range(self.balls)], widths)
        whirl = ["W/e", "z/e"] if self.eccentricity else ["W [mm]", "z [mm]"]
        yield "/plot/whirl", lines(whirl if self.space else whirl[:1])
        yield "/plot/real_time", rr.SeriesLines(names="real time", colors=_GREY)
        for i, vector in enumerate(["/deck/acceleration", *map(sensor_entity, self.sensors)]):
            line = rr.SeriesLines(names=vector.rpartition("/")[2], colors=_HUES[i % len(_HUES)])
            yield f"{size_entity(vector)}", line

    def frames(self, angle: Array, place: Array, turn: Array, balls: Array) -> Parts:
        """What moves: columns, one row per sample.

        Args:
            angle: of the spindle [rad], shape (rows,).
            place: of the deck [m], shape (rows, 2), or 3 in space.
            turn: in space the quaternions (w, x, y, z) of the deck, shape (rows, 4).
            balls: their angles [rad], shape (rows, balls).
        """
        zero = np.zeros_like(angle)
        shaft = 1e3 * np.column_stack([place[:, 0], -place[:, 1], zero])
        half = -0.5 * np.remainder(angle, 2 * np.pi)
        spun = np.column_stack([zero, zero, np.sin(half), np.cos(half)])
        unit = self.eccentricity or 1.0
        whirl = [np.hypot(shaft[:, 0], shaft[:, 1]) / unit]
        if self.space is not None:
            yield from self.space.frames(angle, place, turn, balls)
            yield "/plot/tilt", scalar_columns(1e3 * tilt_of(turn))
            whirl.append(1e3 * place[:, 2] / unit)
        yield "/top/rotor", rr.Transform3D.columns(translation=shaft, quaternion=spun)
        yield "/top/shaft", rr.Points2D.columns(positions=shaft[:, :2])
        yield "/plot/whirl", scalar_columns(np.column_stack(whirl))
        if self.balls:
            places = self.race * np.stack([np.cos(balls), -np.sin(balls)], axis=-1)
            points = rr.Points2D.columns(
                positions=places.reshape(-1, 2), radii=self._drawn_radii(balls).ravel()
            )
            yield "/top/rotor/balls", points.partition(np.full(len(balls), self.balls))
            yield "/plot/balls", scalar_columns(np.degrees(balls))

    def style(self, scalar: str) -> Any:
        """Archetype that says how a scalar is drawn."""
        return _STYLES.get(scalar, lines([scalar]))

    def _drawn_radii(self, balls: Array) -> Array:
        """Radii (rows, balls) in mm: the true ones, smaller for a ball that covers one before it.

        Without contact balls may pass through each other, and started together they stay so.
        """
        drawn = np.tile(self.radii, (len(balls), 1))
        for ball in range(1, self.balls):
            radius, before = self.radii[ball], drawn[:, :ball]
            chord = 2 * self.race * abs(np.sin(0.5 * (balls[:, :ball] - balls[:, ball, None])))
            cover = np.clip(1 - chord / radius, 0.0, 1.0)  # 1: in the same place
            inside = np.minimum(radius, 0.62 * before)
            drawn[:, ball] = (radius + cover * (inside - radius)).min(axis=1)
        return drawn

    def blueprint(self, scalars: Sequence[str] = ()) -> rrb.Blueprint:
        """Lay out the views, with one plot for each of the scalars."""
        turning = "Top view, turning with the rotor"
        left: list[rrb.View] = [
            self._top_view("Top view, as from a camera at rest", "/top", 1.8),
            self._top_view(turning, "/top/rotor", 1.5, also="/top/rest"),
        ]
        whirl = f"whirl W/e [1], e = {self.eccentricity:g} mm" if self.eccentricity else "W [mm]"
        if self.space is not None:
            left[0] = self.space.view()
            whirl = whirl.replace("W/e", "W/e and height z/e").replace("W [mm]", "W and z [mm]")
        middle = [
            _plot("Spindle: speed and command [rad/s]", "/spindle/speed", legend=True),
            _plot(f"Shaft: {whirl}", "/plot/whirl", legend=self.space is not None),
            _plot("Deck: vibration |a| [m/s²]", "/plot/vibration", legend=bool(self.sensors)),
        ]
        if self.balls:
            name = "Balls: angle from the unbalance [deg]"
            middle.insert(2, _plot(name, "/plot/balls", legend=self.balls <= 8, top=True))
        if self.space is not None:
            middle.insert(
                2,
                _plot(
                    "Deck: tilt about x, y and the shaft [mrad]",
                    "/plot/tilt",
                    legend=True,
                    top=True,
                ),
            )
        if self.motor:
            middle.insert(1, _plot("Motor: torque [N m]", "/spindle/torque"))
        columns = rrb.TextLogColumns(text_log_columns=["LogLevel", "Body", "EntityPath"])
        right = [
            rrb.TextDocumentView(origin="/description", name="This run"),
            rrb.TextLogView(origin="/events", name="Events", columns=columns),
        ]
        for scalar in scalars:
            title = _TITLES.get(scalar, scalar.replace("_", " ").capitalize())
            beside, span = _BESIDE.get(scalar, ""), _RANGES.get(scalar)
            right.append(_plot(title, f"/run/{scalar}", beside, legend=bool(beside), span=span))
        sides = [rrb.Vertical(*views) for views in (left, middle, right)]
        return rrb.Blueprint(
            rrb.Horizontal(*sides, column_shares=[4 if self.space else 3, 4, 3]),
            rrb.TimePanel(state="collapsed", timeline="sim_time", play_state="following"),
            rrb.BlueprintPanel(state="hidden"),
            rrb.SelectionPanel(state="hidden"),
        )

    def _top_view(self, name: str, origin: str, reach: float, also: str = "") -> rrb.View:
        span = [-reach * self.race, reach * self.race]
        now = rrb.TimeRangeBoundary.cursor_relative
        trail = rrb.VisibleTimeRange("sim_time", start=now(seconds=-0.05), end=now())
        return rrb.Spatial2DView(
            name=name,
            origin=origin,
            contents=["$origin/**", also] if also else "$origin/**",
            visual_bounds=rrb.VisualBounds2D(x_range=span, y_range=span),
            overrides={"/top/shaft": [rrb.VisibleTimeRanges([trail])]},
        )


def _plot(
    name: str,
    origin: str,
    beside: str = "",
    *,
    legend: bool = False,
    top: bool = False,
    span: tuple[float, float] | None = None,
) -> rrb.View:
    return rrb.TimeSeriesView(
        name=name,
        origin=origin,
        contents=["$origin/**", beside] if beside else "$origin/**",
        axis_x=rrb.TimeAxis(link="LinkToGlobal"),  # zooming one zooms all
        axis_y=rrb.ScalarAxis(range=span) if span else None,
        # On the right, where it covers the end: a run begins with what matters.
        plot_legend=rrb.PlotLegend(
            rrb.Corner2D.RightTop if top else rrb.Corner2D.RightBottom, visible=legend
        ),
    )


def lines(names: list[str], widths: list[float] | None = None) -> rr.SeriesLines:
    """Name and colour the series of an entity."""
    colors = [_GREY if n == "command" else _HUES[i % len(_HUES)] for i, n in enumerate(names)]
    if widths is None:
        widths = [3.0 if n == "speed" else 1.5 for n in names]  # command lies on top of speed
    return rr.SeriesLines(names=names, colors=colors, widths=widths)
