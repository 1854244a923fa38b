"""Section 6.2: what was measured on a drive with five balls. Only orders are compared."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from ab_sim.papers.page import Cell, Picture, Section, Table
from ab_sim.papers.thesis.claims import Claim, table_of
from ab_sim.papers.thesis.drive import Tell
from ab_sim.papers.thesis.five_balls import CHOICES, Bar, Case, alone, bars_of
from ab_sim.papers.thesis.pictures import written

PERIODS = {
    "no period": None,
    "2500 rpm": 2500.0,
    "2000 rpm": 2000.0,
    "3000 rpm": 3000.0,
}
"""Where the variable-speed period of 0.5 s is: figures 6.3 (b), 6.3 (c), 6.4 (b), 6.4 (c)."""
THOUSAND, TEN, FEW = 1000, 10, 40
"""Starts: of the drive as chosen; as many as the thesis averages; of each varied choice."""
ECCENTRIC = (0.1, 0.25, 0.5)
"""Figure 6.6: the disc's unbalance [g cm]."""
OF_EASING = 400
"""Starts with an accelerating period."""
OF_ECCENTRIC = 100
"""Starts for each bar of figure 6.6."""
MUCH = 0.8
""""Much less" is at most this share."""
SPEEDS = np.array([1000, 1500, 1800, 2000, 2150, 2300, 2450, 2600, 3000, 3500, 4500, 6000, 8000.0])
"""Figure 6.5 [rpm]."""
OF_SPEEDS = 30
"""Starts for each of them."""


def experiment_section(folder: Path, tell: Tell) -> Section:
    """Figures 6.3 to 6.6."""
    named = [Case(rpm) for rpm in PERIODS.values()]
    bars = dict(zip(PERIODS, bars_of("figures 6.3 and 6.4", named, THOUSAND, tell), strict=True))
    bars_alone = alone(Case())
    what = "balls that pass each other"
    (passing,) = bars_of(what, [Case(2500.0)], OF_ECCENTRIC, tell, contact=False)
    (easing,) = bars_of("an accelerating period", [Case(2500.0, 200.0)], OF_EASING, tell)
    varied, over_speed, eccentric = varied_bars(tell), speed_bars(tell), eccentric_bars(tell)
    text = (
        "Not printed, and chosen here: M = 0.1 kg, R = 1 cm, damping ratio 0.01, drag "
        "c_b = 0.033 N s/m, arm of friction 1 um, acceleration 400 rad/s^2, restitution 0.5. Each "
        "of mass, damping, friction and drag is halved and doubled below. The deck moves in the "
        "plane: of the printed bars only the horizontal ones have a counterpart, and only orders "
        "are compared. Balls start at random places, at rest on the race.",
        f"Contact: balls that pass through each other end at {passing.words()} with the hold at "
        f"2500 rpm, those that collide at {bars['2500 rpm'].words()}. In the thesis' model balls "
        "that meet may lie on one place; here they line up, and five take a fifth of the race.",
    )  # fmt: skip
    return Section(
        "6.2 The experiments: figures 6.3 to 6.6",
        text,
        (
            table_of(
                "What was measured",
                measured_claims(bars, bars_alone, easing, over_speed, eccentric),
            ),
            _bars_table(bars, bars_alone),
            _choices_table(varied),
        ),
        (
            _bars_picture(folder, bars, bars_alone),
            _speed_picture(folder, over_speed),
            _eccentric_picture(folder, eccentric),
        ),
    )


def varied_bars(tell: Tell) -> dict[str, tuple[float, dict[str, Bar]]]:
    """By choice the whirl without balls [um], and the bars of ``PERIODS``."""
    varied = [(choice, factor) for choice in CHOICES for factor in (0.5, 2.0)]
    cases = [Case(rpm, choice=c, factor=f) for c, f in varied for rpm in PERIODS.values()]
    each = bars_of("choices halved and doubled", cases, FEW, tell)
    found = {}
    for k, (choice, factor) in enumerate(varied):
        own = each[len(PERIODS) * k : len(PERIODS) * (k + 1)]
        name = f"{'half' if factor < 1.0 else 'double'} the {choice}"
        found[name] = (
            alone(Case(choice=choice, factor=factor)), dict(zip(PERIODS, own, strict=True))
        )  # fmt: skip
    return found


Speeds = list[tuple[float, Bar]]
"""By speed the whirl without balls [um], and the bar with balls and the hold at 2500 rpm."""


def speed_bars(tell: Tell) -> Speeds:
    """Figure 6.5; below the hold's speed there is none."""
    cases = [Case(2500.0 if speed > 2500.0 else None, target=float(speed)) for speed in SPEEDS]
    bars = bars_of("figure 6.5", cases, OF_SPEEDS, tell)
    return [(alone(case), bar) for case, bar in zip(cases, bars, strict=True)]


Eccentric = dict[float, tuple[float, Bar, Bar]]
"""By unbalance [g cm] the whirl without balls [um], without a period, with the hold."""


def eccentric_bars(tell: Tell) -> Eccentric:
    """Figure 6.6, at 6000 rpm."""
    cases = [
        Case(rpm, target=6000.0, unbalance=unbalance)
        for unbalance in ECCENTRIC
        for rpm in (None, 2500.0)
    ]
    bars = bars_of("figure 6.6", cases, OF_ECCENTRIC, tell)
    free = [alone(case) for case in cases[::2]]
    each = zip(free, bars[::2], bars[1::2], strict=True)
    return dict(zip(ECCENTRIC, each, strict=True))


def measured_claims(
    bars: dict[str, Bar], bars_alone: float, easing: Bar, speeds: Speeds, eccentric: Eccentric
) -> list[Claim]:
    """What section 6.2 states, at the drive as chosen."""
    without, hold, early, late = bars.values()
    least = [one.mean < whirl for whirl, one in speeds]
    above = [ok for ok, speed in zip(least, SPEEDS, strict=True) if speed > 2300.0]
    peak = SPEEDS[int(np.argmax([whirl for whirl, _ in speeds]))]
    free, plain, held = zip(*eccentric.values(), strict=True)
    return [
        Claim("6.3 (a), (b)", "with balls it shakes less than without",
              f"{without.words()}, without balls {bars_alone:.2f} um",
              without.mean + without.interval < bars_alone),
        Claim("6.3 (b), (c)", "much less with a period of 0.5 s at 2500 rpm than without one",
              f"{hold.words()}, without a period {without.words()}",
              hold.below(without) and hold.mean < MUCH * without.mean,
              f"less by {1 - hold.mean / without.mean:.0%}: where balls start decides more"),
        Claim("6.3, 6.4", "an accelerating period of 0.5 s does the same as a hold",
              f"{easing.words()}, the hold {hold.words()}",
              not easing.below(hold) and not hold.below(easing)),
        Claim("6.4 (a)", "after 2500 rpm the balls are near -180 deg, after 2000, 3000 rpm not",
              ", ".join(f"{one.opposite.mean():.0%}" for one in (hold, early, late))
              + " of the balls within 30 deg of it",
              hold.opposite.mean() > 0.8 and max(early.opposite.mean(), late.opposite.mean()) < 0.5,
              "five balls in contact take 72 deg at least; most balance the disc spread out"),
        Claim("6.4", "2500 rpm: least of the three", f"{hold.words()}; 2000 rpm {early.words()}, "
              f"3000 rpm {late.words()}", hold.below(early) and hold.below(late),
              "the three do not differ by more than their spread"),
        Claim("6.4", "2000 rpm: most of the three", early.words(),
              late.below(early) and hold.below(early), "as above"),
        Claim("6.4", "3000 rpm: more than at 2500 rpm", late.words(), hold.below(late), "as above"),
        Claim("6.5", "the peak without balls is at about 2300 rpm", f"{peak:.0f} rpm",
              abs(peak - 2300.0) < 200.0),
        Claim("6.5", "with balls less at almost all speeds", f"at {sum(least)} of {len(least)} "
              f"speeds: {_speeds_where(least)}", sum(least) >= 0.8 * len(least),
              "below the critical speed balls move towards the unbalance and add to it"),
        Claim("6.5", "with balls less above the critical speed",
              f"at {sum(above)} of {len(above)} speeds", all(above)),
        Claim("6.6", "from 0.1 to 0.25 g cm not much changes, without balls either",
              f"without balls {free[0]:.2f} to {free[1]:.2f} um", free[1] < 1.3 * free[0],
              "a linear suspension whirls in proportion to the unbalance"),
        Claim("6.6", "... with balls and no period", f"{plain[0].words()} to {plain[1].words()}",
              abs(plain[1].mean / plain[0].mean - 1.0) < 0.3),
        Claim("6.6", "... with balls and the period", f"{held[0].words()} to {held[1].words()}",
              abs(held[1].mean / held[0].mean - 1.0) < 0.3),
        Claim("6.6", "at 0.5 g cm it shakes more in all three", ", ".join(
              f"{bars[2] if isinstance(bars[2], float) else bars[2].mean:.2f}"
              for bars in (free, plain, held)) + " um",
              free[2] > free[1] and plain[1].below(plain[2]) and held[1].below(held[2]),
              "the balls' 0.33 g cm are nearest to 0.25"),
        Claim("6.6", "most so without balls", f"{free[2]:.2f} um, with balls "
              f"{plain[2].words()}, with the period {held[2].words()}",
              plain[2].mean < free[2] and held[2].mean < free[2]),
        Claim("6.2", "an average of ten measurements tells the cases apart",
              f"of ten random starts each, {_printed_order(bars):.0%} of all draws show the order "
              "2500 < 3000 < 2000 rpm < no period", _printed_order(bars) > 0.95,
              "the spread between starts is as large as the differences"),
    ]  # fmt: skip


def _printed_order(bars: dict[str, Bar]) -> float:
    """How often means of ten starts, drawn at random, come in the printed order."""
    random = np.random.default_rng(10)
    means = {name: random.choice(one.each, (20000, TEN)).mean(axis=1) for name, one in bars.items()}
    order = [means[name] for name in ("2500 rpm", "3000 rpm", "2000 rpm", "no period")]
    return float(np.all(np.diff(order, axis=0) > 0.0, axis=0).mean())


def _speeds_where(good: list[bool]) -> str:
    return ", ".join(f"{s:.0f}" for s, ok in zip(SPEEDS, good, strict=True) if ok) + " rpm"


def _bars_table(bars: dict[str, Bar], bars_alone: float) -> Table:
    rows: list[tuple[Cell, ...]] = [("6.3 (a)", "no balls", bars_alone, None, None, None)]
    figures = ("6.3 (b)", "6.3 (c), 6.4 (a)", "6.4 (b)", "6.4 (c)")
    for figure, (name, one) in zip(figures, bars.items(), strict=True):
        ten = float(one.each[:TEN].mean())
        rows.append((figure, name, ten, one.mean, one.interval, float(one.each.std())))
    return Table(
        "Whirl at 8000 rpm [um]",
        (
            "figure", "period", "mean of ten starts", f"of {THOUSAND}", "its 95 % interval, +-",
            "spread of one start",
        ),
        tuple(rows),
        3,
    )  # fmt: skip


def _choices_table(varied: dict[str, tuple[float, dict[str, Bar]]]) -> Table:
    """Which orders hold for every choice; of few starts each."""
    rows: list[tuple[Cell, ...]] = []
    always = [True, True, True]
    for name, (free, bars) in varied.items():
        without, hold, early, late = bars.values()
        holds = (
            without.mean + without.interval < free,
            hold.below(without),
            hold.below(early) and hold.below(late),
        )
        always = [one and other for one, other in zip(always, holds, strict=True)]
        rows.append((name, free, *(one.words() for one in bars.values()), *map(_yes, holds)))
    rows.append(("for every choice", *[None] * 5, *map(_yes, always)))
    return Table(
        f"The choices halved and doubled, {FEW} starts each: which orders hold beyond chance?",
        (
            "choice", "no balls [um]", *PERIODS, "balls shake less", "2500 rpm less than none",
            "2500 rpm least of three",
        ),
        tuple(rows),
        3,
    )  # fmt: skip


def _yes(holds: bool) -> str:
    return "yes" if holds else "no"


def _bars_picture(folder: Path, bars: dict[str, Bar], bars_alone: float) -> Picture:
    figure = Figure(figsize=(8.0, 4.6), layout="constrained")
    axes = figure.subplots()
    axes.bar([0], [bars_alone], color="0.6")
    for k, one in enumerate(bars.values(), start=1):
        axes.bar([k], [one.mean], yerr=[one.interval], color="tab:blue", capsize=4, alpha=0.7)
        scatter = np.random.default_rng(k).uniform(-0.3, 0.3, len(one.each))
        axes.plot(k + scatter, one.each, ".", ms=1.5, color="0.3", alpha=0.4)
        axes.plot([k], [one.each[:TEN].mean()], "D", color="tab:red", ms=6)
    axes.set_xticks(range(5), ["no balls", *bars])
    axes.set_ylabel("whirl at 8000 rpm [um]")
    axes.grid(axis="y", alpha=0.3)
    caption = (
        "Figures 6.3 and 6.4: mean of a thousand random starts with its 95 % interval, each start "
        "as a dot, the mean of the first ten in red"
    )
    return written(figure, folder, "6.3", caption)


def _speed_picture(folder: Path, speeds: Speeds) -> Picture:
    figure = Figure(figsize=(8.0, 4.6), layout="constrained")
    axes = figure.subplots()
    axes.plot(SPEEDS, [free for free, _ in speeds], "o-", color="0.5", ms=4, label="without balls")
    means, bars = [one.mean for _, one in speeds], [one.interval for _, one in speeds]
    axes.errorbar(SPEEDS, means, bars, fmt="s-", ms=4, color="tab:blue", label="with balls")
    axes.set_yscale("log")
    axes.set_xlabel("speed [rpm]")
    axes.set_ylabel("whirl [um]")
    axes.grid(alpha=0.3, which="both")
    axes.legend()
    return written(
        figure, folder, "6.5", "Figure 6.5: whirl over speed; with balls held at 2500 rpm"
    )


def _eccentric_picture(folder: Path, eccentric: Eccentric) -> Picture:
    figure = Figure(figsize=(8.0, 4.6), layout="constrained")
    axes = figure.subplots()
    for k, (free, plain, held) in enumerate(eccentric.values()):
        label = k == 0
        axes.bar(k - 0.25, free, 0.22, color="0.6", label="without balls" if label else None)
        for shift, one, color, name in (
            (0.0, plain, "tab:blue", "with balls, no period"),
            (0.25, held, "tab:red", "with balls and period"),
        ):
            axes.bar(k + shift, one.mean, 0.22, yerr=one.interval, color=color, capsize=4,
                     label=name if label else None)  # fmt: skip
    axes.set_xticks(range(len(eccentric)), [f"{u:g}" for u in eccentric])
    axes.set_xlabel("unbalance of the disc [g cm]")
    axes.set_ylabel("whirl at 6000 rpm [um]")
    axes.grid(axis="y", alpha=0.3)
    axes.legend()
    caption = f"Figure 6.6: means of {OF_ECCENTRIC} random starts with their 95 % intervals"
    return written(figure, folder, "6.6", caption)
