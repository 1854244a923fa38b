"""Who has an accuracy measured is told what is run."""

import contextlib
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from ab_sim.analysis.accuracy_cost import accuracy_cost
from ab_sim.analysis.effect_cost import effect_cost
from ab_sim.base.presentation import Progress
from ab_sim.cli import runner
from ab_sim.cli.run import run_command
from ab_sim.cli.scene_commands import RunOptions
from ab_sim.design.basin import basin
from ab_sim.scene import Scene
from tests.accuracy.asked_tolerances import SHORT, wished


class ToldError(Exception):
    """Ends the work at the first thing that is measured."""


def _measured(what: str, spent: int, most: int) -> None:
    if "seconds of CPU time" in what:
        raise ToldError(what)


@pytest.mark.parametrize(
    "study",
    [
        lambda scene: effect_cost(scene, 1, progress=_measured),
        lambda scene: accuracy_cost(scene, 1, progress=_measured),
        lambda scene: basin(scene, 2, progress=_measured),
    ],
    ids=["cost", "accuracy", "basin"],
)
def test_studies_say_what_they_measure_before_they_do(study: Callable[[Scene], Any]) -> None:
    with pytest.raises(ToldError, match="^rk8 at "):
        study(wished("thesis-hold", angle=1.25e-5))


def test_run_says_what_it_measures(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    told: list[tuple[str, int, int]] = []

    @contextlib.contextmanager
    def heard(_: str) -> Iterator[Progress]:
        yield lambda *now: told.append(now)

    monkeypatch.setattr(runner, "progress_bar", heard)
    changes = [*SHORT["packed-balls"], "accuracy.angle=1e-6"]
    run_command(RunOptions("packed-balls", changes)).run()
    whats = [what for what, _, _ in told]
    assert whats[0] == "packed-balls, compiling; ms simulated"
    measured = [what for what in whats if "seconds of CPU time" in what]
    assert measured == whats[1 : 1 + len(measured)] and len(measured) > 3
    assert {what.split(" at ")[0] for what in measured} >= {"rk8", "tsit5"}
    runs = told[1 + len(measured) :]
    assert {what.split(" at ")[0] for what, _, _ in runs} == {
        "packed-balls",
        "packed-balls, without variable-speed period",
        "packed-balls, without balls",
    }
    assert max(done for _, done, _ in runs) == 500 and {most for _, _, most in runs} == {500}
