"""Bounds on metrics, as they are written."""

import math

import numpy as np
import pytest

from ab_sim.base.errors import InputError
from ab_sim.design.bounds import Bound, bound_of


@pytest.mark.parametrize(
    ("text", "bound"),
    [
        ("residual_unbalance<=0.1", Bound("residual_unbalance", "<=", 0.1)),
        (" final_whirl_over_e < 2e-1 ", Bound("final_whirl_over_e", "<", 0.2)),
        ("final_whirl_over_e>=-.5", Bound("final_whirl_over_e", ">=", -0.5)),
        ("in_band_from<500 ms", Bound("in_band_from", "<", 0.5)),
        ("in_band_from > 2", Bound("in_band_from", ">", 2.0)),
        ("settled<1", Bound("settled", "<", 1.0)),
        ("settled", Bound("settled", ">=", 1.0)),
        ("not settled", Bound("settled", "<=", 0.0)),
    ],
)
def test_bounds_as_they_are_written(text: str, bound: Bound) -> None:
    assert bound_of(text) == bound
    assert bound_of(str(bound)) == bound


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "must be METRIC<NUMBER"),
        ("residual_unbalance", "is a number [1]; add a limit"),
        ("residual_unbalance=0.1", "must be METRIC<NUMBER"),
        ("residual_unbalance<", "must be METRIC<NUMBER"),
        ("<0.1", "must be METRIC<NUMBER"),
        ("0.1<residual_unbalance<0.2", "must be METRIC<NUMBER"),
        ("residual_unbalance!=0.1", "must be METRIC<NUMBER"),
        ("residual_unbalanc<0.1", "did you mean 'residual_unbalance'"),
        ("not residual_unbalanc", "did you mean 'residual_unbalance'"),
        ("residual_unbalance<a lot", "'a lot' is not a number"),
        ("residual_unbalance<nan", "must be a finite number"),
        ("residual_unbalance<0.1 mm", "must be a number without unit"),
        ("final_whirl_over_e<0.1 e", "must be a number in e, without unit"),
        ("in_band_from<2 mm", "is a length"),
        ("final_ball_angles<1", "is a list, not a number"),
        ("still changing", "must be METRIC<NUMBER"),
    ],
)
def test_what_cannot_be_meant_is_said(text: str, words: str) -> None:
    with pytest.raises(InputError) as raised:
        bound_of(text)
    assert words in str(raised.value), raised.value


@pytest.mark.parametrize(
    ("op", "expected"),
    [("<", [1, 0, 0, 0]), ("<=", [1, 1, 0, 0]), (">", [0, 0, 1, 0]), (">=", [0, 1, 1, 0])],
)
def test_a_bound_holds_or_not(op: str, expected: list[int]) -> None:
    bound = Bound("residual_unbalance", op, 0.5)
    found = bound.holds([0.1, 0.5, 0.7, None])
    assert found.dtype == bool and found.tolist() == [bool(each) for each in expected]
    assert not bound.holds(math.nan) and bound.upper == op.startswith("<")
    assert Bound("settled", ">=", 1.0).holds(np.array([True, False])).tolist() == [
        True,
        False,
    ]
