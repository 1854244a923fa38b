"""Methods whose steps are emitted for each kind of scene: explicit Runge-Kutta, and ``imex8``.

``imex8`` extrapolates Euler's method, with implicit drag, for stiff drag of the race. Euler's
method runs in n = 1, 2, .. 8 equal parts and is extrapolated to infinite n. Each part evaluates
drag at its end and all else at its beginning. The balls' masses mu become mu + h c for that, with
the part's length h and the drag c, which costs one division. Any amount of drag is stable. Without
iterations and Jacobian, the step is emitted like that of an explicit method, can be cut at events
and computed in lanes.

Constantinescu and Sandu (2010), SIAM J. Sci. Comput. 31, 4452-4477: implicit-explicit
extrapolation. Deuflhard (1985), SIAM Review 27, 505-535: extrapolation of stiff systems. Hairer and
Wanner, Solving Ordinary Differential Equations II, IV.9.
"""

from collections.abc import Sequence

import numpy as np

from ab_sim.engine.integrate.registry import Stepper, register
from ab_sim.engine.kernels.runge_kutta import Extrapolation, Tableau


def explicit(
    name: str, order: int, source: str, rows: Sequence[Sequence[float]], weights: Sequence[float]
) -> Stepper:
    """Return a method from the rows below its tableau's diagonal; stage times are the row sums."""
    stages = len(weights)
    a, b = np.zeros((stages, stages)), np.array(weights)
    for i, row in enumerate(rows, start=1):
        a[i, : len(row)] = row

    def growth(z: complex) -> complex:
        ones = np.ones(stages, dtype=complex)
        return complex(1 + z * (b @ np.linalg.solve(np.eye(stages) - z * a, ones)))

    tableau = Tableau(a, b, a.sum(axis=1))
    return Stepper(name, order, source, tableau, stages, growth, takes_lanes=True)


RK4 = register(
    explicit(
        name="rk4",
        order=4,
        source="Kutta (1901)",
        rows=[[1 / 2], [0, 1 / 2], [0, 0, 1]],
        weights=[1 / 6, 1 / 3, 1 / 3, 1 / 6],
    )
)


TSIT5 = register(
    explicit(
        name="tsit5",
        order=5,
        source="Tsitouras, Computers & Mathematics with Applications 62 (2011) 770-775",
        rows=[
            [0.161],
            [-0.008480655492356989, 0.335480655492357],
            [2.8971530571054935, -6.359448489975075, 4.3622954328695815],
            [5.325864828439257, -11.748883564062828, 7.4955393428898365, -0.09249506636175525],
            [
                5.86145544294642,
                -12.92096931784711,
                8.159367898576159,
                -0.071584973281401,
                -0.028269050394068383,
            ],
        ],
        weights=[
            0.09646076681806523,
            0.01,
            0.4798896504144996,
            1.379008574103742,
            -3.290069515436081,
            2.324710524099774,
        ],
    )
)


RK8 = register(
    explicit(
        name="rk8",
        order=8,
        source="Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.5 (DOP853)",
        rows=[
            [
                0.05260015195876773,
            ],
            [
                0.0197250569845379,
                0.0591751709536137,
            ],
            [
                0.02958758547680685,
                0.0,
                0.08876275643042054,
            ],
            [
                0.2413651341592667,
                0.0,
                -0.8845494793282861,
                0.924834003261792,
            ],
            [
                0.037037037037037035,
                0.0,
                0.0,
                0.17082860872947386,
                0.12546768756682242,
            ],
            [
                0.037109375,
                0.0,
                0.0,
                0.17025221101954405,
                0.06021653898045596,
                -0.017578125,
            ],
            [
                0.03709200011850479,
                0.0,
                0.0,
                0.17038392571223998,
                0.10726203044637328,
                -0.015319437748624402,
                0.008273789163814023,
            ],
            [
                0.6241109587160757,
                0.0,
                0.0,
                -3.3608926294469414,
                -0.868219346841726,
                27.59209969944671,
                20.154067550477894,
                -43.48988418106996,
            ],
            [
                0.47766253643826434,
                0.0,
                0.0,
                -2.4881146199716677,
                -0.590290826836843,
                21.230051448181193,
                15.279233632882423,
                -33.28821096898486,
                -0.020331201708508627,
            ],
            [
                -0.9371424300859873,
                0.0,
                0.0,
                5.186372428844064,
                1.0914373489967295,
                -8.149787010746927,
                -18.52006565999696,
                22.739487099350505,
                2.4936055526796523,
                -3.0467644718982196,
            ],
            [
                2.273310147516538,
                0.0,
                0.0,
                -10.53449546673725,
                -2.0008720582248625,
                -17.9589318631188,
                27.94888452941996,
                -2.8589982771350235,
                -8.87285693353063,
                12.360567175794303,
                0.6433927460157636,
            ],
        ],
        weights=[
            0.054293734116568765,
            0.0,
            0.0,
            0.0,
            0.0,
            4.450312892752409,
            1.8915178993145003,
            -5.801203960010585,
            0.3111643669578199,
            -0.1521609496625161,
            0.20136540080403034,
            0.04471061572777259,
        ],
    )
)


METHOD = Extrapolation((1, 2, 3, 4, 5, 6, 7, 8))


def growth(z: complex) -> complex:
    """Return the stability function for all motions except drag."""
    pairs = zip(METHOD.divisions, METHOD.weights, strict=True)
    return sum((weight * (1 + z / n) ** n for n, weight in pairs), 0j)


IMEX8 = register(
    Stepper(
        name="imex8",
        order=8,
        source="Constantinescu and Sandu (2010), SIAM J. Sci. Comput. 31, 4452-4477",
        weights=METHOD,
        evaluations=sum(METHOD.divisions),
        growth=growth,
        solves_drag=True,
        takes_lanes=True,
    )
)
