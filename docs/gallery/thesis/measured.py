"""What section 6.2 states of the drive with five balls, at the drive as chosen."""

import numpy as np

from gallery.thesis.claims import (
    ABOUT,
    BALANCED,
    BY_CONSTRUCTION,
    ENGLISH_ONLY,
    MUCH,
    READ,
    UNDECIDED,
    Claim,
    barely_opposite,
    degrees,
    opposite,
)
from gallery.thesis.drive import OPPOSITE, THESIS, Period, start_ups
from gallery.thesis.five_balls import OTHERS_NAMED, UNBALANCE, Bar, mean_of

PERIODS = {
    "no period": None,
    "2500 rpm": 2500.0,
    "2000 rpm": 2000.0,
    "3000 rpm": 3000.0,
}
"""Where the variable-speed period of 0.5 s is: figures 6.3 (b), 6.3 (c), 6.4 (b), 6.4 (c)."""
TEN = 10
"""Starts: as many as the thesis averages."""
ECCENTRIC = (0.1, 0.25, 0.5)
"""Figure 6.6: the disc's unbalance [g cm]."""
LITTLE = 0.3
"""What "does not change so much" changes by, relative; ours."""
SPEEDS = np.array([1000, 1500, 1800, 2000, 2150, 2300, 2450, 2600, 3000, 3500, 4500, 6000, 8000.0])
"""Figure 6.5 [rpm]."""
ENOUGH = 0.9
"""Share of what the disc needs that balls near -180 deg carry towards it; ours."""
BALLS = 0.33
"""Their unbalance together [g cm]."""
NEIGHBOUR = 2.0 * np.arcsin(1.26e-3 / 1e-2)
"""Between the centres of balls that touch [rad]."""
TOUCHING = BALLS * float(np.exp(1j * NEIGHBOUR * np.arange(-2, 3)).real.mean())
"""What five that touch carry [g cm]: as much as they can."""
BETTER = 0.02
"""What is improved is less by this share at least; ours."""
LIMITED = 0.8
"""Share of the whirl that the balls' limit has to explain; ours."""
Speeds = list[tuple[float, Bar]]
"""By speed the whirl without balls [um], and the bar with balls and the hold at 2500 rpm."""
Eccentric = dict[float, tuple[float, Bar, Bar]]
"""By unbalance [g cm] the whirl without balls [um], without a period, with the hold."""


def measured_claims(
    bars: dict[str, Bar],
    bars_alone: float,
    easing: Bar,
    speeds: Speeds,
    eccentric: Eccentric,
    two_balls: list[float],
    best: float,
    shares: list[float],
    others: dict[str, Bar],
) -> list[Claim]:
    """What section 6.2 states of what it measured.

    Parameters
    ----------
    bars
        By ``PERIODS``.
    bars_alone
        Whirl without balls [um].
    easing
        With an accelerating period.
    speeds
        Figure 6.5.
    eccentric
        Figure 6.6.
    two_balls
        Final W/e of the drive of chapter 4, without a period and with the hold.
    best
        Least final W/e of that drive with any period of section 4.4's grid.
    shares
        Whirl with the hold at 2500 rpm over that without, of each varied choice.
    others
        By ``PERIODS``, with other choices of what is not printed.
    """
    return [
        *_period_claims(bars, bars_alone, easing, two_balls, shares),
        *_order_claims(bars, others),
        *_left_claims(bars, bars_alone),
        _by_control(bars, two_balls[0], best),
        *_speed_claims(speeds),
        *_eccentric_claims(eccentric),
    ]


def _period_claims(
    bars: dict[str, Bar],
    bars_alone: float,
    easing: Bar,
    two_balls: list[float],
    shares: list[float],
) -> list[Claim]:
    without, hold, early, late = bars.values()
    share, share_of_two = hold.mean / without.mean, two_balls[1] / two_balls[0]
    carried = [-float(one.balls.real.mean()) for one in (hold, early, late)]
    # Of the same starts: those of the hold are more.
    same_starts = hold.first(len(easing.each))
    more, interval = easing.more_than(same_starts)
    moved = -float(easing.balls.real.mean())
    limit = ABOUT * same_starts.mean
    same = None if abs(more) - interval <= limit < abs(more) + interval else (
        abs(more) + interval <= limit
    )  # fmt: skip
    return [
        Claim("6.3 (a), (b)", "with balls it shakes less than without",
              f"{without.words()}, without balls {bars_alone:.2f} um",
              without.mean + without.interval < bars_alone),
        Claim("6.3 (b), (c)", "less with a period of 0.5 s at 2500 rpm than without one (the "
              "English: much less)",
              f"{hold.words()}, without a period {without.words()}: {_apart(hold, without)}, "
              f"{share - 1.0:+.0%}; {min(shares):.2f} to {max(shares):.2f} times over the choices "
              "below, of which the verdict is not", hold.below(without)),
        Claim("6.3", "(b) corresponds to 4.1, (c) to 4.7",
              f"the hold's whirl over that without: {share:.2f} here, {share_of_two:.2f} with the "
              f"two balls at 200 rad/s, at rest (ours: alike to {ABOUT:.0%})",
              abs(share / share_of_two - 1.0) <= ABOUT),
        Claim("6.3, 6.4", "an accelerating period of 0.5 s does the same as a hold",
              f"{easing.words()}, the hold {same_starts.words()} from the same "
              f"{len(easing.each)} starts: {_words(more, interval)} (ours: within {ABOUT:.0%})",
              same,
              f"{UNDECIDED}: the interval reaches beyond {ABOUT:.0%}" if same is None else ""),
        Claim("6.3, 6.4", "the period moves the balls to -180 deg",
              f"{moved:.2f} g cm towards it, of {UNBALANCE:g} needed (ours: {ENOUGH:.0%})",
              moved >= ENOUGH * UNBALANCE, "no more than the hold does: see 6.4 (a)"),
        Claim("6.4 (a)", "after 2500 rpm the balls are near -180 deg, after 2000, 3000 rpm not",
              ", ".join(f"{x:.2f}" for x in carried) + f" g cm towards it, of {UNBALANCE:g} needed "
              f"and {TOUCHING:.2f} of a row that touches (ours: {ENOUGH:.0%} of what is needed, "
              "and of the others less)", carried[0] >= ENOUGH * UNBALANCE > max(carried[1:]),
              "they lie in the same places after each"),
        *_as_figure_claims(bars),
    ]  # fmt: skip


def _order_claims(bars: dict[str, Bar], others: dict[str, Bar]) -> list[Claim]:
    """Which period shakes least and most: with two choices of what the thesis does not print."""
    (_, hold, early, late), (_, hold_2, early_2, late_2) = bars.values(), others.values()
    order, order_2 = printed_order(bars), printed_order(others)
    return [
        _by_choice("6.3, 6.4", "means of ten show 2500 < 3000 < 2000 rpm, and 2500 rpm < no period",
                   f"{order:.0%} of all draws of ten do (ours: more than half)", order > 0.5,
                   order_2 > 0.5, f"{order_2:.0%} do"),
        _by_choice("6.4", "2500 rpm: least of the three", f"{hold.words()}; 2000 rpm "
                   f"{early.words()}, 3000 rpm {late.words()}",
                   hold.below(early) and hold.below(late),
                   hold_2.below(early_2) and hold_2.below(late_2),
                   f"by {_apart(early_2, hold_2)} and {_apart(late_2, hold_2)}"),
        _by_choice("6.4", "2000 rpm: most of the three", f"than 2500 rpm by {_apart(early, hold)}, "
                   f"than 3000 rpm by {_apart(early, late)}",
                   late.below(early) and hold.below(early),
                   late_2.below(early_2) and hold_2.below(early_2),
                   f"by {_apart(early_2, hold_2)} and {_apart(early_2, late_2)}"),
        _by_choice("6.4", "3000 rpm: more than at 2500 rpm", f"by {_apart(late, hold)}",
                   hold.below(late), hold_2.below(late_2), f"by {_apart(late_2, hold_2)}"),
    ]  # fmt: skip


def _by_choice(figure: str, printed: str, ours: str, here: bool, there: bool, words: str) -> Claim:
    """A claim that is undecided where two choices of what is not printed disagree.

    Parameters
    ----------
    figure
        Of the thesis.
    printed
        What it says.
    ours
        What our runs say.
    here
        Whether it holds with the page's choices.
    there
        Whether it holds with ``OTHERS``.
    words
        What runs with those say.
    """
    verdict = None if here != there else here
    now, then = ("it holds", "it does not") if here else ("it does not hold", "it does")
    undecided = f"{UNDECIDED}: with the choices here {now}, with {OTHERS_NAMED} {then}: {words}"
    return Claim(figure, printed, ours, verdict, undecided if verdict is None else "")


def _as_figure_claims(bars: dict[str, Bar]) -> list[Claim]:
    """That the balls are not at -180 deg after 2000 and 3000 rpm, as in 4.13 and 4.14."""
    numbers = {"2000 rpm": ("6.4 (b)", "4.13", 2.0), "3000 rpm": ("6.4 (c)", "4.14", 3.0)}
    two = start_ups([(THESIS, Period(start)) for *_, start in numbers.values()])
    claims = []
    for (name, (figure, shown, _)), run in zip(numbers.items(), two, strict=True):
        five = -float(bars[name].balls.real.mean())
        there, barely = bool(opposite(run.angles).all()), barely_opposite(run.angles)
        less = five < ENOUGH * UNBALANCE
        undecided = f"{UNDECIDED}: by {OPPOSITE:g} deg they are in {shown}, by "
        undecided += f"{OPPOSITE - READ:g} deg they are not"
        claims.append(
            Claim(f"{figure}, {shown}", f"{name}: the balls are not near -180 deg, as in {shown}",
                  f"five carry {five:.2f} g cm towards it, of {UNBALANCE:g} needed; two are at "
                  f"{degrees(run.angles)} 2.5 s after the critical speed (ours: less than "
                  f"{ENOUGH:.0%}; not in its vicinity)",
                  None if less and barely else less and not there,
                  undecided if less and barely else "they are")
        )  # fmt: skip
    return [*claims, _not_there_claim(bars)]


def _not_there_claim(bars: dict[str, Bar]) -> Claim:
    """That after 2000 and 3000 rpm nothing improves because the balls are not at -180 deg."""
    none, best, *others = (one.left() for one in bars.values())
    lies = [-float(bars[name].balls.real.mean()) for name in ("2500 rpm", "2000 rpm", "3000 rpm")]
    left = [mean_of(each - none)[0] / UNBALANCE for each in (best, *others)]
    near = lies[0] >= ENOUGH * UNBALANCE > max(lies[1:])
    return Claim(
        "6.4 (b), (c)", "residual unbalance is not improved because they are not near -180 deg",
        "2500, 2000, 3000 rpm: " + ", ".join(f"{x:.2f}" for x in lies) + " g cm towards it, "
        + ", ".join(f"{x:+.3f}" for x in left) + " of the disc's unbalance (ours: near after 2500 "
        "rpm alone, and least left there)", near and left[0] < min(left[1:]),
        "they lie in the same places after each; their distribution along the race decides",
    )  # fmt: skip


def _left_claims(bars: dict[str, Bar], bars_alone: float) -> list[Claim]:
    """What is concluded of the balls' residual unbalance, which was not measured."""
    without, hold, *others = (one.left() for one in bars.values())
    mean, left = mean_of(hold)[0] / UNBALANCE, mean_of(without)[0] / UNBALANCE
    each = (bars["2500 rpm"].mean / bars_alone, bars["no period"].mean / bars_alone)
    pairs = zip(each, (mean, left), strict=True)
    alike = all(abs(whirl - share) <= ABOUT * share for whirl, share in pairs)
    claims = [
        Claim("section 6.2", "residual unbalance is eliminated",
              f"{mean:.2f} of the disc's left with the hold at 2500 rpm, {left:.2f} without a "
              f"period (ours: {BALANCED:g} at most)", mean <= BALANCED,
              "friction holds balls where they are"),
        Claim("section 6.2", "that is why it shakes less",
              f"of the whirl without balls {each[0]:.2f} is left with the hold, {each[1]:.2f} "
              f"without a period (ours: the same shares as of the unbalance, to {ABOUT:.0%})",
              alike),
    ]  # fmt: skip
    for figure, name, each_left, improves in (
        ("6.4 (a)", "2500 rpm", hold, True),
        ("6.4 (b)", "2000 rpm", others[0], False),
        ("6.4 (c)", "3000 rpm", others[1], False),
    ):
        more, interval = mean_of((each_left - without) / UNBALANCE)
        better = more + interval < 0.0 and -more >= BETTER * left
        claims.append(
            Claim(figure, f"{name}: residual unbalance is {'' if improves else 'not '}improved",
                  f"by {more:+.3f} +- {interval:.3f} of the disc's, of {left:.2f} without a period "
                  f"(ours: {BETTER:.0%} of that less)", None if improves else not better,
                  ENGLISH_ONLY if improves else "it is improved, too")
        )  # fmt: skip
    return claims


def _by_control(bars: dict[str, Bar], without: float, best: float) -> Claim:
    """That the period alone improves a balancer whose mechanism stays (chapter 7)."""
    name, one = min(bars.items(), key=lambda item: item[1].mean)
    plain = bars["no period"]
    five = one.below(plain) and one.mean <= (1.0 - BETTER) * plain.mean
    return Claim(
        "chapter 7", "it improves by the control's parameters, with the balancer as it is",
        f"five balls: {one.mean / plain.mean - 1.0:+.0%} of the whirl ({name}); two of chapter 4: "
        f"{best / without - 1.0:+.1%} with the best period of 4.4's grid (ours: {BETTER:.0%} less "
        "in one of the drives)", five or best <= (1.0 - BETTER) * without,
    )  # fmt: skip


def _speed_claims(speeds: Speeds) -> list[Claim]:
    least = [one.mean + one.interval < whirl for whirl, one in speeds]
    shares = np.array([one.mean / whirl for whirl, one in speeds])
    beyond = SPEEDS > 2300.0
    above = [ok for ok, far in zip(least, beyond, strict=True) if far]
    peaks = [float(SPEEDS[int(np.argmax(curve))]) for curve in
             ([whirl for whirl, _ in speeds], [one.mean for _, one in speeds])]  # fmt: skip
    return [
        Claim("6.5", "it peaks at about 2300 rpm, which is the critical speed",
              f"at {peaks[0]:.0f} rpm without balls, {peaks[1]:.0f} with them", None,
              BY_CONSTRUCTION),
        Claim("6.5", "with balls less at almost all speeds", f"at {sum(least)} of {len(least)} "
              f"speeds: {_speeds_where(least)} (ours: at four of five)",
              sum(least) >= 0.8 * len(least),
              "below the critical speed balls move towards the unbalance and add to it"),
        Claim("6.5", "with balls less above the critical speed",
              f"at {sum(above)} of {len(above)} speeds", all(above)),
        Claim("6.5", "especially beyond the critical speed",
              f"whirl with balls over that without: {shares[beyond].mean():.2f} in the mean above "
              f"2300 rpm, {shares[~beyond].mean():.2f} up to it (ours: {MUCH:.0%} of that at most)",
              bool(shares[beyond].mean() < MUCH * shares[~beyond].mean())),
    ]  # fmt: skip


def _eccentric_claims(eccentric: Eccentric) -> list[Claim]:
    free, plain, held = zip(*eccentric.values(), strict=True)
    towards = {kind: [-float(one.balls.real.mean()) for one in group]
               for kind, group in (("without a period", plain), ("with it", held))}  # fmt: skip
    limit = (ECCENTRIC[2] - BALLS) / ECCENTRIC[2] * free[2]
    return [
        Claim("6.6", "from 0.1 to 0.25 g cm not much changes, also without balls",
              f"without balls {free[0]:.2f} to {free[1]:.2f} um (ours: by {LITTLE:.0%})",
              free[1] <= (1.0 + LITTLE) * free[0],
              "a linear suspension whirls in proportion to the unbalance"),
        Claim("6.6", "from 0.1 to 0.25 g cm not much changes: with balls and no period",
              f"{plain[0].words()} to {plain[1].words()} (ours: by {LITTLE:.0%})",
              abs(plain[1].mean / plain[0].mean - 1.0) <= LITTLE),
        Claim("6.6", "from 0.1 to 0.25 g cm not much changes: with balls and the period",
              f"{held[0].words()} to {held[1].words()} (ours: by {LITTLE:.0%})",
              abs(held[1].mean / held[0].mean - 1.0) <= LITTLE),
        Claim("6.6", "the balls' position is the same for every unbalance, as in chapter 5",
              "; ".join(f"{', '.join(f'{x:.2f}' for x in each)} g cm towards -180 deg {kind}"
                        for kind, each in towards.items())
              + " at 0.1, 0.25, 0.5 g cm: they go where the disc needs them, until all are used up",
              None, "said of the simulation, not counted: see 5.6, 5.12"),
        Claim("6.6", "at 0.5 g cm it shakes more in all three",
              f"{free[2]:.2f}, {plain[2].mean:.2f}, {held[2].mean:.2f} um",
              free[2] > free[1] and plain[1].below(plain[2]) and held[1].below(held[2])),
        Claim("6.6", "most so without balls", f"{free[2]:.2f} um, with balls "
              f"{plain[2].words()}, with the period {held[2].words()}",
              plain[2].mean < free[2] and held[2].mean < free[2]),
        Claim("6.6", "at 0.5 g cm the limit of the balls is exceeded",
              f"all at -180 deg leave {limit:.1f} um; ours {plain[2].mean:.1f} um, with the period "
              f"{held[2].mean:.1f} um (ours: of which the limit is {LIMITED:.0%})",
              all(LIMITED * one.mean <= limit <= one.mean for one in (plain[2], held[2]))),
    ]  # fmt: skip


def _apart(one: Bar, other: Bar) -> str:
    """By how much one shakes more than the other."""
    return _words(*one.more_than(other))


def _words(more: float, interval: float) -> str:
    return f"{more:+.2f} +- {interval:.2f} um"


def printed_order(bars: dict[str, Bar]) -> float:
    """How often means of ten starts, drawn at random, come in the printed order."""
    random = np.random.default_rng(10)
    means = {name: random.choice(one.each, (20000, TEN)).mean(axis=1) for name, one in bars.items()}
    order = [means[name] for name in ("2500 rpm", "3000 rpm", "2000 rpm")]
    rises = np.all(np.diff(order, axis=0) > 0.0, axis=0)
    return float((rises & (means["2500 rpm"] < means["no period"])).mean())


def _speeds_where(good: list[bool]) -> str:
    return ", ".join(f"{s:.0f}" for s, ok in zip(SPEEDS, good, strict=True) if ok) + " rpm"
