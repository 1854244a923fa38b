"""Method of Tsitouras of order 5 with six stages."""

from ab_sim.engine.integrate.explicit import explicit
from ab_sim.engine.integrate.registry import register

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
