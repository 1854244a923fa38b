"""Recovery over drag: the composite index, one ball in place of several, and what is kept."""

from typing import Any

import pytest

from ab_sim.analysis import recovery
from ab_sim.analysis.recovery import (
    DRAGS,
    Recovery,
    composite_of,
    in_one_ball,
    recover,
    recovery_over_drag,
)
from ab_sim.base.errors import SceneError
from ab_sim.scene import load_scene


def made(settling: float | None, amplitude: float) -> Recovery:
    return Recovery(settling, amplitude, 0.0, settling, 0.0, "balanced", -1.0, "stable", True, 1.0)


def test_the_composite_index_is_the_reports() -> None:
    """t_c + r_p mean(t_c) / mean(r_p); what does not settle is in no mean."""
    found = composite_of([made(1.0, 6e-6), made(2.0, 3e-6), made(None, 1.0), made(6.0, 3e-6)])
    assert found is not None
    assert found.factor == pytest.approx(3.0 / 4e-6)
    assert found.index[2] is None
    assert [found.index[k] for k in (0, 1, 3)] == pytest.approx([5.5, 4.25, 8.25])
    assert found.best == 1
    assert composite_of([made(None, 1.0)]) is None


@pytest.mark.parametrize(("case", "best"), [(1, 0.2), (2, 0.3), (3, 0.3)])
def test_the_best_drag_is_the_reports(case: int, best: float) -> None:
    """Published: about 0.2 to 0.3 N s/m."""
    found = recovery_over_drag(load_scene(f"nsc-case-{case}"), DRAGS)
    assert found.best_drag == best
    times = [run.settling_time for run in found.at_drags]
    amplitudes = [run.maximum_amplitude for run in found.at_drags]
    assert times == sorted(times, key=lambda time: time or 0.0), "more drag, later"
    assert amplitudes == sorted(amplitudes, reverse=True), "more drag, less"


@pytest.mark.parametrize("case", [1, 2])
def test_two_balls_together_are_one_with_twice_the_drag(case: int) -> None:
    scene = load_scene(f"nsc-case-{case}")
    one = in_one_ball(scene)
    assert one.balls.count == 1 and one.balls.total_mass == scene.balls.total_mass
    assert one.start.ball_angles == pytest.approx(scene.start.ball_angles[:1])
    together = recover(scene)
    single = recover(recovery.with_drag(one, 0.4))
    assert single.settling_time == pytest.approx(together.settling_time, abs=1e-8)
    assert single.maximum_amplitude == pytest.approx(together.maximum_amplitude, rel=1e-10)


def test_one_ball_of_unlike_ones() -> None:
    scene = load_scene(
        "nsc-case-3", ["balls.mass=[1e-4, 3e-4]", "start.ball_angles=[0.0, 1.5707963267948966]"]
    )
    one = in_one_ball(scene)
    assert one.balls.masses == pytest.approx((4e-4,))
    assert one.start.ball_angles == pytest.approx((1.2490457723982544,)), "atan2(3, 1)"


def test_what_was_computed_is_not_computed_again(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = load_scene("nsc-case-1")
    told: list[tuple[str, int, int]] = []
    first = recovery_over_drag(scene, (0.2, 0.3), lambda *what: told.append(what))
    assert [what[1:] for what in told] == [(k, 6) for k in range(6)]

    def never(*_: Any) -> Recovery:
        raise AssertionError("computed again")

    monkeypatch.setattr(recovery, "recover", never)
    assert recovery_over_drag(scene, (0.2, 0.3)) == first


def test_the_report_is_plain_and_complete() -> None:
    found = recovery_over_drag(load_scene("nsc-case-1"), (0.2, 0.3))
    report = found.report()
    assert report["settling_time"] == report["over_drag"][0]["settling_time"]
    assert report["one_ball"]["over_drag"][1]["drag"] == 0.3
    assert report["best_drag"] == 0.2 and found.balls_coincide
    single = recovery_over_drag(in_one_ball(load_scene("nsc-case-1")), (0.2,))
    assert single.report()["one_ball"] is None and not single.balls_coincide


def test_without_balls_there_is_no_drag() -> None:
    scene = load_scene("nsc-case-1", ["balls.count=0", "start.ball_angles="])
    with pytest.raises(SceneError, match="^balls.count = 0: must be at least 1"):
        recovery_over_drag(scene)
