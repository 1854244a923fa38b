"""Coordinates in which a deck's own motion is x'' + c x' + k x = 0, and the way there and back.

The axes stand still while one collocation step is solved: those of the rotor at its beginning, or
the ground's. Formulas on numbers, as in ``ab_sim.equations``; a vector of coordinates is a list.
``own`` is what Python says of the motion before a run, see ``LinearPart``.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

from ab_sim.equations.motion import SpindleMotion
from ab_sim.equations.orientation import half_product, to_deck, to_ground, turn_of, turning_of
from ab_sim.equations.planar import gravity_on_rotating_axes
from ab_sim.equations.sums import Number, any_has

Vector = Sequence[Number]
Axes = tuple[Number, Number]
"""Cosine and sine of the angle that the rotor's axes have turned since the step's beginning."""


class DeckModes(NamedTuple):
    """Of a deck in space: its modes in place and turn, and the reverse, line by line."""

    from_modes: Sequence[Vector]
    """Shape (7, 7): of six modes and the quaternion's real part they make X, Y, Z and the
    quaternion's x, y, z, w; the last line and the last column have one entry, the last."""
    to_modes: Sequence[Vector]
    """The reverse, shape (7, 7)."""


class DeckPlace(NamedTuple):
    """Where a deck is, at an instant of the step."""

    own: DeckModes | None
    axes: Axes
    state: Vector


class Coordinates(Protocol):
    """What collocation asks of a deck model."""

    count: int
    """How many coordinates there are."""
    has_modes: bool
    """Whether ``own`` is a ``DeckModes``, and not None."""
    are_alike: bool
    """Whether c and k are the same in all of them."""

    def only_own_motion(self, effects: Any) -> bool:
        """Whether nothing else that the equations say depends on the deck's states."""

    def of_state(self, own: DeckModes | None, state: Vector) -> tuple[Vector, Vector]:
        """x and v of a state at the step's beginning."""

    def state(self, own: DeckModes | None, axes: Axes, x: Vector, v: Vector) -> Vector:
        """The deck's states."""

    def accelerations(
        self, deck: Any, effects: Any, spindle: SpindleMotion, at: DeckPlace, a: Vector
    ) -> Vector:
        """x'' of the accelerations that are solved for."""

    def change(self, at: DeckPlace, change: Vector) -> Vector:
        """What a change of x'' adds to the accelerations that are solved for."""

    def on_next_axes(self, c: Number, s: Number, f: Vector) -> Vector:
        """Forces on the right of these equations, on axes that have turned by an angle."""


class PlanarCoordinates:
    """Displacement on axes that stand still."""

    count = 2
    has_modes = False
    are_alike = True

    def only_own_motion(self, effects: Any) -> bool:
        """The linear suspension, the same in every direction, is all there is."""
        return not any_has(effects, "mount_stiffening", "space_force")

    def of_state(self, own: DeckModes | None, state: Vector) -> tuple[Vector, Vector]:
        """See ``Coordinates``."""
        return [state[0], state[1]], [state[2], state[3]]

    def state(self, own: DeckModes | None, axes: Axes, x: Vector, v: Vector) -> Vector:
        """See ``Coordinates``."""
        return [*_back(axes, x), *_back(axes, v)]

    def accelerations(
        self, deck: Any, effects: Any, spindle: SpindleMotion, at: DeckPlace, a: Vector
    ) -> Vector:
        """See ``Coordinates``."""
        g1, g2 = gravity_on_rotating_axes(effects, spindle)
        one, two, (c, s) = a[0] + g1, a[1] + g2, at.axes
        return [c * one - s * two, s * one + c * two]

    def change(self, at: DeckPlace, change: Vector) -> Vector:
        """See ``Coordinates``."""
        return _back(at.axes, change)

    def on_next_axes(self, c: Number, s: Number, f: Vector) -> Vector:
        """See ``Coordinates``."""
        return _back((c, s), f)


class CoordinatesInSpace:
    """Modes of the deck's small motions, and the quaternion's real part, on the ground's axes."""

    count = 7
    has_modes = True
    are_alike = False

    def only_own_motion(self, effects: Any) -> bool:
        """Its tilt turns what all forces act along."""
        return False

    def of_state(self, own: DeckModes | None, state: Vector) -> tuple[Vector, Vector]:
        """See ``Coordinates``."""
        turn = state[3:7]
        rate = half_product(turn, *state[10:13])
        return into_modes(own, state[0:3], turn), into_modes(own, state[7:10], rate)

    def state(self, own: DeckModes | None, axes: Axes, x: Vector, v: Vector) -> Vector:
        """See ``Coordinates``."""
        (place, turn), (velocity, rate) = out_of_modes(own, x), out_of_modes(own, v)
        return [*place, *turn, *velocity, *turning_of(turn, rate)]

    def accelerations(
        self, deck: Any, effects: Any, spindle: SpindleMotion, at: DeckPlace, a: Vector
    ) -> Vector:
        """See ``Coordinates``."""
        turn, omega, g = at.state[3:7], at.state[10:13], deck.gravity
        x, y, z = to_ground(turn_of(turn), a[0], a[1], a[2])
        twice = half_product(half_product(turn, *omega), *omega)
        more = half_product(turn, a[3], a[4], a[5])
        change = [one + other for one, other in zip(twice, more, strict=True)]
        return into_modes(at.own, [x + g[0], y + g[1], z + g[2]], change)

    def change(self, at: DeckPlace, change: Vector) -> Vector:
        """See ``Coordinates``."""
        (place, turn), now = out_of_modes(at.own, change), at.state[3:7]
        force = to_deck(turn_of(now), place[0], place[1], place[2])
        return [*force, *turning_of(now, turn)]

    def on_next_axes(self, c: Number, s: Number, f: Vector) -> Vector:
        """The axes stand still for ever."""
        return f


def _back(axes: Axes, vector: Vector) -> list[Number]:
    """A vector on axes that stand still, on the rotor's."""
    c, s = axes
    return [c * vector[0] + s * vector[1], c * vector[1] - s * vector[0]]


def into_modes(own: DeckModes | None, place: Vector, turn: Vector) -> list[Number]:
    """Coordinates of a place and a quaternion; of their rates those of the coordinates."""
    assert own is not None
    six = [*place, *turn[1:4]]
    found = [_row(own.to_modes[q], six) for q in range(6)]
    return [*found, own.to_modes[6][6] * turn[0]]


def out_of_modes(own: DeckModes | None, x: Vector) -> tuple[list[Number], list[Number]]:
    """The reverse: a place and a quaternion."""
    assert own is not None
    six, of = list(x[:6]), own.from_modes
    place = [_row(of[q], six) for q in range(3)]
    return place, [of[6][6] * x[6], *(_row(of[q], six) for q in range(3, 6))]


def _row(line: Vector, six: Vector) -> Number:
    one = line[0] * six[0] + line[1] * six[1] + line[2] * six[2]
    return one + (line[3] * six[3] + line[4] * six[4] + line[5] * six[5])
