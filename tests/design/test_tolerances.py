"""How built drives are spread, as it is written."""

import math

import numpy as np
import pytest

from ab_sim.base.errors import InputError
from ab_sim.design.tolerances import (
    FACTOR,
    OFFSET,
    RANDOM,
    VALUE,
    Discrete,
    LogNormal,
    Normal,
    Tolerance,
    Uniform,
    tolerance_of,
)

INF = math.inf


@pytest.mark.parametrize(
    ("text", "what", "distribution"),
    [
        ("balls.mass=5%", FACTOR, Normal(0.0, 0.05)),
        ("balls.mass = 5 % ", FACTOR, Normal(0.0, 0.05)),
        ("balls.mass=10 mg", OFFSET, Normal(0.0, 1e-5)),
        ("balls.mass=1e-5", OFFSET, Normal(0.0, 1e-5)),
        ("balls.mass=normal:1 g,10 mg", VALUE, Normal(1e-3, 1e-5)),
        ("balls.mass=normal:1,0.01 g", VALUE, Normal(1e-3, 1e-5)),
        ("balls.mass=normal:0.001, 5%", VALUE, Normal(1e-3, 5e-5)),
        ("balls.mass=normal:1 g,10 mg, low=0.9 g", VALUE, Normal(1e-3, 1e-5, 0.9e-3, INF)),
        ("balls.mass=5%, low=-10%, high=8%", FACTOR, Normal(0.0, 0.05, -0.1, 0.08)),
        ("balls.mass=10 mg, high=20 mg", OFFSET, Normal(0.0, 1e-5, -INF, 2e-5)),
        ("rotor.eccentricity=lognormal:1e-4,40%", VALUE, LogNormal(1e-4, 0.4)),
        (
            "rotor.eccentricity=lognormal:0.1 mm,40%,high=0.3 mm",
            VALUE,
            LogNormal(1e-4, 0.4, -INF, 3e-4),
        ),
        ("rotor.eccentricity=lognormal:40%", FACTOR, LogNormal(1.0, 0.4, -INF, INF, 1.0)),
        ("start.speed=uniform:-60,30 rpm", VALUE, Uniform(-2 * math.pi, math.pi)),
        ("balls.mass=uniform:5%", FACTOR, Uniform(-0.05, 0.05)),
        ("balls.mass=uniform:10 mg", OFFSET, Uniform(-1e-5, 1e-5)),
        ("start.ball_angles=random", RANDOM, Uniform(0.0, 1.0)),
    ],
)
def test_spreads_as_they_are_written(text: str, what: str, distribution: object) -> None:
    found = tolerance_of(text)
    assert (found.what, found.distribution) == (what, pytest.approx(distribution, rel=1e-12))
    assert type(found.distribution) is type(distribution) and found.text == text
    assert found.per_ball == (what == RANDOM) and found.group is None


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("balls.mass=discrete:1 g,0.002", (1e-3, 2e-3)),
        ("balls.count=discrete:2,3,3", (2, 3, 3)),
        ("solver.stepper=discrete:rk4,rk8", ("rk4", "rk8")),
        ("start.ball_angles=discrete:[0, 1],[2, 3]", ([0, 1], [2, 3])),
    ],
)
def test_discrete_ones_have_their_values(text: str, values: tuple[object, ...]) -> None:
    found = tolerance_of(text)
    assert found.values == values and found.distribution == Discrete(len(values))


@pytest.mark.parametrize("text", ["5% per ball", "5%, per ball", "5%,group=steel, per ball"])
def test_options_stand_behind(text: str) -> None:
    found = tolerance_of("balls.mass=" + text)
    assert found.per_ball and found.group == ("steel" if "steel" in text else None)
    assert found.distribution == Normal(0.0, 0.05)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("balls.mass", "must be KEY=5%"),
        ("balls.mass=", "must be KEY=5%"),
        ("balls.mas=5%", "did you mean 'balls.mass'"),
        ("balls.mass=five%", "'five' is not a number"),
        ("balls.mass=0%", "'0%' must be above 0"),
        ("balls.mass=-5%", "'-5%' must be above 0"),
        ("balls.mass=nan%", "must be a finite number"),
        ("balls.mass=12 mm", "is a length"),
        ("balls.mass=gamma:1,2", "must be KEY=5%"),
        ("balls.mass=normal:1,2,3", "must be KEY=5%"),
        ("balls.mass=normal:,2", "must be KEY=5%"),
        ("start.speed=normal:0,5%", "5% of 0 is 0"),
        ("balls.mass=lognormal:1e-3,1e-4", "standard deviation of the logarithm, e.g. 40%"),
        ("balls.mass=lognormal:-1,40%", "'-1' must be above 0"),
        ("balls.mass=uniform:2,1", "the lower end first"),
        ("balls.mass=uniform:1,2, low=1", "are for normal and lognormal"),
        ("balls.mass=discrete:", "must be KEY=5%"),
        ("balls.mass=discrete:[1", "its values"),
        ("balls.count=5%", "takes whole numbers; write discrete:V,V"),
        ("solver.stepper=5%", "takes no numbers; write discrete:V,V"),
        ("balls.mass=random", "random is for start.ball_angles only"),
        ("balls.mass=uniform:1 g,3", "'3' must have a unit"),
        ("balls.mass=normal:1 g,3", "'3' must have a unit"),
        ("start.ball_angles=random, low=1", "are for normal and lognormal"),
        ("rotor.eccentricity=5% per ball", "per ball is for balls.mass, balls.radius"),
        ("balls.mass=5%, low=-1e-4", "limit the deviation here, e.g. low=-10%"),
        ("balls.mass=5%, low=1%, high=-1%", "low must be below"),
        ("balls.mass=5%, low=50%", "of the distribution; must be at least 1e-06"),
        ("balls.mass=5%, low=1%, low=2%", "low is given twice"),
        ("balls.mass=5%, group=a b", "a name of letters"),
    ],
)
def test_what_cannot_be_meant_is_said(text: str, words: str) -> None:
    with pytest.raises(InputError) as raised:
        tolerance_of(text)
    assert words in str(raised.value), raised.value


def test_a_report_tells_all_that_draws_follow_from() -> None:
    texts = ["5%", "5% per ball", "5%, group=a", "6%", "5%, low=-10%", "uniform:5%", "lognormal:5%"]
    found = [tolerance_of(f"balls.mass={text}") for text in texts]
    assert len({str(each.report()) for each in found}) == len(texts)
    assert Tolerance(*found[0][:-1], text="other").report() == found[0].report()


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("balls.mass=5%, low=-5%, high=5%", "truncnorm(-1.0, 1.0, 0.0, 0.05)"),
        ("balls.mass=lognormal:1e-3,40%", "lognorm(0.4, 0.0, 1e-3)"),
        ("balls.mass=lognormal:40%", "lognorm(0.4, -1.0, 1.0)"),
        ("balls.mass=uniform:1,3", "uniform(1.0, 2.0)"),
        ("balls.mass=normal:3,2", "norm(3.0, 2.0)"),
    ],
)
def test_quantiles_are_those_of_scipy(text: str, expected: str) -> None:
    from scipy import stats

    shares = np.linspace(0.001, 0.999, 99)
    name, _, numbers = expected.rstrip(")").partition("(")
    theirs = getattr(stats, name)(*map(float, numbers.split(","))).ppf(shares)
    assert np.allclose(tolerance_of(text).distribution.at(shares), theirs, rtol=1e-9, atol=1e-12)


def test_a_share_of_a_negative_mean_is_a_positive_deviation() -> None:
    found = tolerance_of("profile.acceleration=normal:-40,5%").distribution
    assert found == Normal(-40.0, 2.0)
