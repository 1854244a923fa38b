"""Functions of a model's expressions as C: slopes, a step, speeds, specific forces of sensors.

The expressions are lowered as for machine code, so that they have the same bits.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from ab_sim.engine.kernels.constants import layout_of_constants, traced_bodies
from ab_sim.engine.kernels.emission import Emission
from ab_sim.engine.kernels.model import Model
from ab_sim.engine.kernels.runge_kutta import Tableau
from ab_sim.export.c_code.declarations import GIVEN, KINDS, DriveParameter
from ab_sim.model.dynamics.assemble import of_ball
from ab_sim.model.dynamics.system import System
from ab_sim.model.equations.motion import BALL_COLUMNS, Ball
from ab_sim.scene.sensors import Accelerometer
from ab_sim.tracing import Graph, Level
from ab_sim.tracing.c_text import Store, c_literal, c_statements
from ab_sim.tracing.expression import Expression, lifted, reachable_nodes
from ab_sim.tracing.lowering import without_cosines


class Equations(NamedTuple):
    """Equations of a scene in C."""

    text: str
    """C text of the functions."""
    used: frozenset[str]
    """Inputs of the model that the functions read."""
    derived: int
    """Number of values derived from the parameters."""
    ball_derived: int
    """Number of values derived for each ball."""
    columns: tuple[str, ...]
    """Names, as in ``BallConstants``, of the balls' constants that are derived."""


def equations_of(
    system: System,
    parameters: Sequence[DriveParameter],
    kinds: Sequence[type[Any]],
    channels: Sequence[str],
    sensors: Mapping[str, Accelerometer],
) -> Equations:
    """Return the functions of a system in C.

    Parameters
    ----------
    system
        System to convert.
    parameters
        All fields of ``struct drive_parameters``.
    kinds
        Kinds of the profile's segments.
    channels
        Names of the deck's channels, as fields of ``struct drive_outputs``.
    sensors
        Sensors of the scene.
    """
    emitted = [_Kind(system, kind, _places(parameters), channels) for kind in kinds]
    forces = _forces(system, channels, sensors, _places(parameters)) if sensors else _NOTHING
    used = frozenset(forces.used.union(*(kind.used for kind in emitted)))
    columns = tuple(name for name in BALL_COLUMNS if name in used and name not in GIVEN)
    derived = _of_balls(system, columns) if columns else _NOTHING
    parts = [derived.text, *(kind.text() for kind in emitted), _dispatch(kinds, bool(columns))]
    return Equations(
        "\n".join(part for part in [*parts, forces.text] if part),
        used | derived.used,
        max(kind.numbers for kind in emitted),
        max(kind.columns for kind in emitted),
        columns,
    )


class _Part(NamedTuple):
    """C functions with the model's inputs that they read."""

    text: str
    used: frozenset[str]
    """Names of the model's inputs that the functions read."""


_NOTHING = _Part("", frozenset())


def _read_by(roots: Iterable[Expression]) -> frozenset[str]:
    """Return the names of the inputs that expressions read."""
    return frozenset(x.payload for x in reachable_nodes(roots) if x.op == "input")


def _places(parameters: Sequence[DriveParameter]) -> dict[str, str]:
    """Return C expressions that read the model's constants, by the names of the model's inputs."""
    places = {name: f"b->{name}[i]" for name in BALL_COLUMNS}
    for parameter in parameters:
        if parameter.is_of_balls:
            places[parameter.inputs[0]] = f"p->{parameter.name}[i]"
        else:
            for name, (place, _, _) in zip(parameter.inputs, parameter.places, strict=True):
                places[name] = f"p->{place}"
    return places


class _Kind:
    """C functions of the model for segments of one kind.

    Values that depend on parameters only are computed once per change of a parameter (``derive``).
    They are numbered here, balls' values apart, and read by ``slope`` and ``finish``.
    """

    def __init__(
        self, system: System, kind: type[Any], places: dict[str, str], channels: Sequence[str]
    ) -> None:
        model = Model(system, kind)
        emission = Emission(model, layout_of_constants(system, kind), kind._fields)
        self._model, self._name = model, KINDS[kind]
        n, states = model.count, model.states
        self._derived = [x for x in emission.derived if n or not x.each]
        self._inputs = places | {f"segment.{name}": f"s->{name}" for name in kind._fields}
        self._inputs |= {"phase": "s->phase", "angle": "s->start_angle"}
        self._inputs |= {"time": "time", "profile_time": "profile_time"}
        self._inputs |= {f"deck[{j}]": f"y[{j}]" for j in range(states)}
        self._inputs |= {"theta": "theta[i]", "rate": "rate[i]"}
        self._known: dict[int, str] = {}
        self.numbers = self.columns = 0
        for x in self._derived:
            if x.each:
                self._known[x.number] = f"d->ball_derived[{self.columns}][i]"
                self.columns += 1
            else:
                self._known[x.number] = f"d->derived[{self.numbers}]"
                self.numbers += 1
        self._slope = [Store(x, f"k[{j}]") for j, x in enumerate(emission.roots["slope"][:states])]
        if n:
            theta, rate = emission.roots["slope"][states : states + 2]
            self._slope.append(Store(theta, f"k[{states} + i]", True))
            self._slope.append(Store(rate, f"k[{states + n} + i]", True))
        self._sample = [
            Store(x, f"out->{name}")
            for x, name in zip(
                emission.roots["sample"], ("angle", "speed", "command", *channels), strict=True
            )
        ]
        if n:
            for name in ("theta", "rate"):
                x = model.graph.input(name, per_ball=True)
                field = "ball_angle" if name == "theta" else "ball_rate"
                self._sample.append(Store(x, f"out->{field}[i]", True))

    @property
    def used(self) -> frozenset[str]:
        """Names of the inputs that the functions read."""
        roots = [store.root for store in [*self._slope, *self._sample]]
        return _read_by(roots)

    def text(self) -> str:
        """Return the text of the functions."""
        derived = [Store(x, self._known[x.number], x.each) for x in self._derived]
        segment = "const struct drive_segment *s"
        state = f"const struct drive *d, {segment}, double time, const double *y, double *k"
        return "\n".join(
            [
                self._function("derive", f"struct drive *d, {segment}", derived, {}),
                self._function("slope", state, self._slope, self._known),
                self._function(
                    "finish",
                    f"{state}, double profile_time, struct drive_outputs *out",
                    [*self._slope, *self._sample],
                    self._known,
                ),
            ]
        )

    def _function(
        self, name: str, arguments: str, stores: Sequence[Store], given_names: Mapping[int, str]
    ) -> str:
        """Return a C function; ``given_names``: C text of known values, by their nodes' numbers."""
        lines = c_statements(stores, self._inputs, given_names)
        first, n = self._model.states, self._model.count
        return function(f"static void {name}_{self._name}", arguments, lines, (first, first + n))


def function(head: str, arguments: str, lines: Sequence[str], balls: tuple[int, int]) -> str:
    """Return a C function's text, with declarations of those pointers that its lines use.

    Parameters
    ----------
    head
        Return type and name.
    arguments
        Arguments of the function.
    lines
        Body of the function.
    balls
        Positions of the first ball's angle and rate in the state.
    """
    body = "\n".join(lines)

    def uses(word: str) -> bool:
        return re.search(rf"\b{word}\b", body) is not None

    pointers = [
        line
        for word, line in (
            ("p->", "const struct drive_parameters *p = &d->p;"),
            ("b->", "const struct drive_balls *b = &d->balls;"),
            ("theta\\[", f"const double *theta = y + {balls[0]};"),
            ("rate\\[", f"const double *rate = y + {balls[1]};"),
        )
        if re.search(rf"(?<![\w>.]){word}", body)
    ]
    body = "\n".join([*pointers, body])
    names = re.findall(r"(\w+)(?:,|$)", arguments)
    unused = [f"(void){name};" for name in names if not uses(name)]
    indented = [f"    {line}" for line in [*unused, *body.split("\n")] if line]
    return f"{head}({arguments})\n{{\n" + "\n".join(indented) + "\n}\n"


def _of_balls(system: System, columns: Sequence[str]) -> _Part:
    """Return the C function for the derived constants of the balls, with the bits of Python."""
    graph = Graph()
    m, a, radius = (
        graph.input(name, Level.PARAMETER, True) for name in ("mass", "radius", "race_radius")
    )
    _, effects = traced_bodies(system, lambda name: graph.input(name, Level.PARAMETER))
    constants = of_ball(Ball(m, a), radius, 0.0, effects)  # type: ignore[arg-type]
    roots = [lifted(graph, getattr(constants, name)) for name in columns]
    stores = [
        Store(x, f"d->balls.{name}[i]", True)
        for x, name in zip(without_cosines(roots), columns, strict=True)
    ]
    places = {name: f"d->p.{field}[i]" for name, (field, *_) in GIVEN.items()}
    lines = c_statements(stores, places)
    head = "/* Derived constants of the balls. */\nstatic void derive_balls"
    return _Part(function(head, "struct drive *d", lines, (0, 0)), _read_by(roots))


def _dispatch(kinds: Sequence[type[Any]], columns: bool) -> str:
    """Return the C functions that dispatch on the kind of a segment."""
    names = [KINDS[kind] for kind in kinds]
    begin = ["derive_balls(d);"] if columns else []
    segment = "const struct drive_segment *s"
    state = f"const struct drive *d, {segment}, double time, const double *y, double *k"
    more = "double profile_time, struct drive_outputs *out"
    forms = (
        ("static void derive", f"struct drive *d, {segment}", "derive_{}(d, s)"),
        ("static void slope", state, "slope_{}(d, s, time, y, k)"),
        (
            "static void finish",
            f"{state}, {more}",
            "finish_{}(d, s, time, y, k, profile_time, out)",
        ),
        ("static double speed_of", f"{segment}, double time", "speed_{}(s, time)"),
        ("static double angle_of", f"{segment}, double time", "angle_{}(s, time)"),
    )
    functions = [_of_segments(kind) for kind in kinds]
    for head, arguments, form in forms:
        call = "return " if head.startswith("static double") else ""
        lines = begin if head.endswith("derive") else []
        if len(names) == 1:
            lines = [*lines, f"{call}{form.format(names[0])};"]
        elif call:
            first, second = (form.format(name) for name in names)
            lines = [*lines, f"return s->kind == RAMP ? {first} : {second};"]
        else:
            first, second = (form.format(name) for name in names)
            lines = [*lines, "if (s->kind == RAMP)", f"    {first};", "else", f"    {second};"]
        functions.append(function(head, arguments, lines, (0, 0)))
    return "\n".join(functions)


def _of_segments(kind: type[Any]) -> str:
    """Return the C functions for speed and angle of a segment, with the bits of Python."""
    graph, functions = Graph(), []
    segment = kind(*(graph.input(name) for name in kind._fields))
    time = graph.input("time")
    inputs = {name: f"s->{name}" for name in kind._fields} | {"time": "time"}
    for what in ("speed", "angle"):
        roots = without_cosines([getattr(segment, what)(time)])
        lines = c_statements([Store(roots[0], "const double value")], inputs)
        head = f"static double {what}_{KINDS[kind]}"
        arguments = "const struct drive_segment *s, double time"
        functions.append(function(head, arguments, [*lines, "return value;"], (0, 0)))
    return "\n".join(functions)


def _forces(
    system: System,
    channels: Sequence[str],
    sensors: Mapping[str, Accelerometer],
    places: dict[str, str],
) -> _Part:
    """Return the C function for the specific force at each sensor, with the bits of Python."""
    graph = Graph()
    deck, effects = traced_bodies(system, lambda name: graph.input(name, Level.PARAMETER))
    sample = [graph.input(name) for name in channels]
    inputs = places | {name: f"out->{name}" for name in channels}
    stores = []
    for k, sensor in enumerate(sensors.values()):
        force = deck.specific_force(effects, sample, sensor.position)
        roots = without_cosines([lifted(graph, x) for x in force])
        stores += [Store(x, f"force[{k}][{axis}]") for axis, x in enumerate(roots)]
    used = _read_by(store.root for store in stores).difference(channels)
    lines = c_statements(stores, inputs)
    head = (
        "/* Specific force at each sensor [m/s^2], on the deck's axes. */\n"
        "static void specific_forces"
    )
    arguments = "const struct drive *d, const struct drive_outputs *out, double (*force)[AXES]"
    return _Part(function(head, arguments, lines, (0, 0)), used)


def step_of(tableau: Tableau) -> str:
    """Return the C function for a step of an explicit Runge-Kutta method.

    The order of the sums and their fused operations are those of the machine code, so that states
    agree to the bit.
    """
    *stages, (_, end) = tableau.stages()
    lines = [f"double k[{len(stages)}][STATES]; /* slopes of the stages after the first */"]

    def combined(terms: Sequence[tuple[float, int]]) -> list[str]:
        first, *others = [(c_literal(w), f"k[{k - 1}][j]" if k else "k0[j]") for w, k in terms]
        return [
            "for (int j = 0; j < STATES; j++) {",
            f"    double sum = {first[0]} * {first[1]};",
            *(f"    sum = fma({weight}, {slope}, sum);" for weight, slope in others),
            "    trial[j] = fma(length, sum, y[j]);",
            "}",
        ]

    for k, (share, terms) in enumerate(stages):
        time = f"fma({c_literal(share)}, length, begin)"
        lines += [*combined(terms), f"slope(d, s, {time}, trial, k[{k}]);"]
    lines += combined(end)
    arguments = (
        "const struct drive *d, const struct drive_segment *s, double begin, double length, "
        "const double *y, const double *k0, double *trial"
    )
    return function("static void runge_kutta", arguments, lines, (0, 0))
