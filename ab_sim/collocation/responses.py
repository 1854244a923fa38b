"""What x'' + c x' + k x = f(t) makes of an f that is a polynomial through N Gauss nodes.

For a step of length h with nodes t_j, and G the response to a unit impulse,

    x(t) = (1 - k U(t)) x_0 + G(t) v_0 + sum_k f_k int_0^t G(t - s) l_k(s) ds
    v(t) = -k G(t) x_0 + G'(t) v_0     + sum_k f_k int_0^t G'(t - s) l_k(s) ds

with U the response to f = 1, and l_k the nodes' Lagrange polynomials: exact however large c h and
k h^2 are. Tables hold the integrals up to N instants, each line with one number for each. A ball
under linear drag has k = 0; with c = 0 as well, v is the plain integral of f.

From one instant to the next a response is carried on by its own power series (``impulse``), whose
integrals with l_k are known (``nodes.Nodes.moments``). Where it changes too fast for that, it is
integrated numerically, as far back as it lasts.

A table has 3 N + 5 lines of N instants: for each k the integrals into x, into v, and into
c v + k x; U, G and G'; and what P_N, the first of Legendre's polynomials that none through the
nodes has in it, makes of x and v.
"""

from ab_sim.collocation.impulse import NEAR, NOTHING, ImpulseResponse, impulse, panel
from ab_sim.collocation.nodes import CollocationNodes
from ab_sim.compiling.kinds import Floats, Table, fma, put_product, scratch

LENGTH, DAMPING, STIFFNESS, MOST_UNIT, BEYOND, COUNT = 0, 1, 2, 3, 4, 5
"""Numbers of a table: h [s]; c, k; U at most, up to the step's end; what f = P_N makes of x at the
instants, at most; and one for who keeps tables."""
NUMBERS = 6
"""How many these are."""


def lines_of_table(count: int) -> int:
    """How many lines a table has for so many nodes."""
    return 3 * count + 5


def fill(
    nodes: CollocationNodes,
    chosen: int,
    of: ImpulseResponse,
    before: Table,
    table: Table,
    numbers: Floats,
) -> None:  # fmt: skip
    """The table of a step up to a set of instants.

    Args:
        nodes: the Nodes.
        chosen: which of their sets.
        of: what it is a table of.
        before: the table up to the set before, if this one goes on from there.
        table: shape (lines, N).
        numbers: of the table, shape (NUMBERS,); COUNT stays.
    """
    count = nodes.at.size
    now = scratch(2, count + 1)
    impulse_now = scratch(2)
    begin = begin_chain(nodes, chosen, before, now, impulse_now)
    most, unit, filled = 0.0, 0.0, -1
    for stop in range(count):
        end = nodes.stops[chosen, stop]
        if end > 1.5:
            break
        go_on(nodes, chosen * count + stop, begin, end, of, now, impulse_now)
        begin, column = end, nodes.columns[chosen, stop]
        if column >= 0:
            filled = column
            put_column(now, impulse_now, table, column)
            most = max(most, abs(now[0, count]))
            unit = max(unit, abs(table[3 * count, column]))
    for line in range(lines_of_table(count) if filled + 1 < count else 0):
        last = table[line, filled]
        for column in range(filled + 1, count):
            table[line, column] = last
    c, k = of.c, of.k
    for line in range(count):
        x, v, pull = table[line], table[count + line], table[2 * count + line]
        for column in range(count):
            pull[column] = c * v[column] + k * x[column]
    numbers[LENGTH], numbers[DAMPING], numbers[STIFFNESS] = of.length, of.c, of.k
    numbers[MOST_UNIT] = max(unit, abs(of.to_one))
    numbers[BEYOND] = most


def begin_chain(
    nodes: CollocationNodes, chosen: int, before: Table, now: Table, impulse_now: Floats
) -> float:
    """What a chain begins with; returns where."""
    count = nodes.at.size
    if nodes.begins[chosen] == 0:
        for i in range(count + 1):
            now[0, i] = now[1, i] = 0.0
        impulse_now[0], impulse_now[1] = 0.0, 1.0
        return 0.0
    last = count - 1
    for i in range(count):
        now[0, i], now[1, i] = before[i, last], before[count + i, last]
    now[0, count], now[1, count] = before[3 * count + 3, last], before[3 * count + 4, last]
    impulse_now[0], impulse_now[1] = before[3 * count + 1, last], before[3 * count + 2, last]
    stop, begin = 0, 0.0
    while stop < count and nodes.stops[chosen - 1, stop] < 1.5:
        begin = nodes.stops[chosen - 1, stop]
        stop += 1
    return begin


def put_column(now: Table, impulse_now: Floats, table: Table, column: int) -> None:
    """Responses at an instant into a table."""
    count, unit = table.shape[1], 0.0
    for i in range(count):
        table[i, column], table[count + i, column] = now[0, i], now[1, i]
        unit += now[0, i]
    table[3 * count, column] = unit
    table[3 * count + 1, column], table[3 * count + 2, column] = impulse_now[0], impulse_now[1]
    table[3 * count + 3, column], table[3 * count + 4, column] = now[0, count], now[1, count]


def go_on(
    nodes: CollocationNodes,
    piece: int,
    begin: float,
    end: float,
    of: ImpulseResponse,
    now: Table, impulse_now: Floats,
) -> None:  # fmt: skip
    """Responses at the end of a piece of the step, from those at its beginning."""
    count, d, length, c, k = nodes.at.size, end - begin, of.length, of.c, of.k
    if of.fastest * length * d > NEAR:
        integrate(nodes, end, length, c, k, now)
        impulse_now[0], impulse_now[1] = impulse(c, k, end * length)
        return
    moments, used, into = nodes.moments[piece], of.terms, scratch(2, count + 1)
    values, rates = of.values, of.rates
    u, g, r = 0.0, 0.0, 0.0
    beyond_x, beyond_v = 0.0, 0.0
    for m in range(used):
        # P_N for itself: products take eight columns at once.
        beyond_x = fma(values[m], moments[m, count], beyond_x)
        beyond_v = fma(rates[m], moments[m, count], beyond_v)
        power = moments[m, count + 1]
        u += values[m] * power * d / (m + 1)
        g += values[m] * power
        r += rates[m] * power
        if (abs(values[m + 1]) + abs(values[m + 2]) * d) * power < NOTHING:
            used = m + 1
            break
    put_product(into[0, 0:count], values[0:used], moments)
    put_product(into[1, 0:count], rates[0:used], moments)
    into[0, count], into[1, count] = beyond_x, beyond_v
    u, g = length * length * u, length * g
    for i in range(count + 1):
        x, v = now[0, i], now[1, i]
        now[0, i] = (x + (g * v - k * u * x)) + length * length * into[0, i]
        now[1, i] = (r * v - k * g * x) + length * into[1, i]
    x, v = impulse_now[0], impulse_now[1]
    impulse_now[0], impulse_now[1] = x + ((g * v - k * u * x) - 0.0), r * v - k * g * x


def integrate(
    nodes: CollocationNodes, end: float, length: float, c: float, k: float, now: Table
) -> None:
    """Responses at an instant, by quadrature in panels as long as a response lasts."""
    count, points = nodes.at.size, nodes.points.shape[1]
    until, ago, polynomials = end * length, 0.0, scratch(count + 1)
    for i in range(count + 1):
        now[0, i] = now[1, i] = 0.0
    while ago < until:
        width = panel(c, k, ago, until)
        if width == 0.0:
            break
        for p in range(points):
            t = fma(width, nodes.points[0, p], ago)
            g, r = impulse(c, k, t)
            g, r = width * nodes.points[1, p] * g, width * nodes.points[1, p] * r
            put_polynomials(nodes, (until - t) / length, polynomials)
            for i in range(count + 1):
                now[0, i] = fma(g, polynomials[i], now[0, i])
                now[1, i] = fma(r, polynomials[i], now[1, i])
        ago += width


def put_polynomials(nodes: CollocationNodes, x: float, out: Floats) -> None:
    """l_k(x), and behind them P_N(x), x as a fraction of the step; ``out`` has shape (N + 1,)."""
    count, before, behind = nodes.at.size, 1.0, 1.0
    for k in range(count):
        out[k] = before * nodes.scale[k]
        before *= x - nodes.at[k]
    for k in range(count - 1, -1, -1):
        out[k] *= behind
        behind *= x - nodes.at[k]
    out[count] = nodes.leading * behind
