"""Which numbers of balls circulate at a speed: those that a run, begun elsewhere, keeps so."""

import pytest

from ab_sim.analysis.circulating import BunchRange, drive_of, lasting_speed, stalled
from ab_sim.analysis.coexisting import CoexistingCirculation, coexisting_circulation
from ab_sim.analysis.equilibria import equilibria_of
from ab_sim.cli.stability import circulation_lines
from ab_sim.scene import load_scene
from tests.analysis.circulating.runs import AT, stalling


def test_two_to_six_of_six_balls_circulate_beside_balance() -> None:
    scene = stalling()
    found = coexisting_circulation(scene, AT)
    assert found.numbers == (6, 5, 4, 3, 2, 1)
    assert [each.bunch.count for each in found.states] == [6, 5, 4, 3, 2]
    speeds = [307.3141, 310.197, 313.657, 318.079, 324.672]
    assert [each.speed for each in found.states] == pytest.approx(speeds, rel=2e-6)
    assert "balanced" in {state.label for state in equilibria_of(scene, AT).stable}
    assert [each.exact is not None for each in found.states] == [True] + 4 * [False]
    for each in found.states:
        assert each.over_speed is not None and each.over_speed.low < AT < each.over_speed.high
        assert each.over_drag is not None and each.over_drag.low < 0.05 < each.over_drag.high


def test_what_a_run_does_not_keep_is_left_out() -> None:
    """At 500 rad/s two of six could circulate by the closed form, but the others join them."""
    scene = stalling()
    numbers = drive_of(scene)
    assert numbers is not None
    two = stalled(numbers, 500.0, 2)
    assert two is not None and lasting_speed(scene, two) is None
    assert [each.bunch.count for each in coexisting_circulation(scene, 500.0).states] == [6]


def test_where_they_cannot_it_says_where_they_could() -> None:
    found = coexisting_circulation(stalling(cb=1.0), AT)
    assert found.states == () and found.speed == AT
    (reach,) = found.other_speed_ranges
    assert reach.high < AT


def test_of_many_balls_some_numbers_are_looked_for() -> None:
    found = coexisting_circulation(stalling(m=(1e-3,) * 20, cb=1.0), AT)
    assert found.numbers[0] == 20 and found.numbers[-1] == 1 and len(found.numbers) == 8


@pytest.mark.parametrize("speed", [1e-3, 5.0, 100.0])
def test_balls_that_the_rotor_takes_along_do_not_circulate(speed: float) -> None:
    """Far below the critical speed a bunch nearly keeps up, and the unbalance holds it."""
    assert coexisting_circulation(stalling(), speed).states == ()


def test_without_a_rotors_unbalance_the_closed_form_is_exact() -> None:
    first = coexisting_circulation(stalling(me=0.0), AT).states[0]
    assert first.exact is not None and first.exact.stable
    assert first.speed == pytest.approx(first.bunch.speed, rel=1e-11)


def test_a_spindle_at_rest_and_scenes_that_are_not_known() -> None:
    assert coexisting_circulation(stalling(), 0.0).states == ()
    for name in ("no-ball", "packed-balls", "feeding-deck"):
        found = coexisting_circulation(load_scene(name), 300.0)
        assert found.reason_not_covered and found.report()["states"] == []


def test_a_closed_form_that_is_not_borne_out_says_so() -> None:
    """The two lines do not contradict each other: which of them is the closed form's is said."""
    reach = BunchRange(2, 1.46, 1.806, "fold", "fold", 1.0, 1.0)
    for speed, denied in ((1.8, True), (2.0, False)):
        found = CoexistingCirculation(speed, None, (2, 1), (), (reach,))
        first, second = circulation_lines(found, 2, [])
        assert first == f"no bunch of balls circulates at {speed:g} rad/s"
        assert second.strip().startswith(
            "by the closed form, all 2 can circulate at spindle speeds"
        )
        assert ("the full equations do not confirm this" in second) is denied
