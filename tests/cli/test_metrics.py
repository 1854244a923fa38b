"""`ab-sim metrics`: what a run is judged by, in words."""

import json

import pytest

import ab_sim as package
from ab_sim.analysis.metrics import described_metrics, reported_metrics
from ab_sim.analysis.metrics.metric import Better, MetricKind
from ab_sim.design.judged import metric_columns
from tests.cli.tool import ab_sim


def test_all_are_listed_a_line_each() -> None:
    shown = ab_sim("metrics")
    assert shown.returncode == 0, shown.stderr
    cells = [
        [cell.strip() for cell in line.split("│")[1:-1]]
        for line in shown.stdout.splitlines()
        if line.startswith("│")
    ]
    assert cells == [
        [each.name, each.unit, each.better, each.taken_by, each.meaning, each.equation]
        for each in described_metrics()
    ]


def test_json_is_the_same() -> None:
    shown = ab_sim("metrics", "--json")
    assert json.loads(shown.stdout) == [each._asdict() for each in described_metrics()]


@pytest.mark.parametrize("name", ["in_band_from", "final_whirl_relative_to_no_balls"])
def test_one_is_told_with_all_there_is(name: str) -> None:
    (metric,) = described_metrics(name)
    shown = ab_sim("metrics", name)
    for text in metric:
        assert text in shown.stdout
    assert json.loads(ab_sim("metrics", name, "--json").stdout) == [metric._asdict()]


def test_what_is_no_metric_is_one_error() -> None:
    shown = ab_sim("metrics", "final_whirl_over_r")
    assert shown.returncode == 2 and shown.stdout == ""
    (line,) = shown.stderr.splitlines()
    assert line.startswith("ab-sim: metric 'final_whirl_over_r': no such metric; did you mean ")
    assert "'final_whirl_over_e'" in line


def test_the_help_of_a_run_says_where_they_are_listed() -> None:
    assert "ab-sim metrics lists units" in " ".join(ab_sim("run", "--help").stdout.split())


def test_every_metric_says_what_it_is() -> None:
    for each in described_metrics():
        assert each.meaning and each.equation and each.unit, each.name
        assert each.better in {better.value for better in Better}
        assert "\n" not in each.equation


def test_sweep_tune_and_robust_take_the_names_that_are_said_to_be_theirs() -> None:
    for each in described_metrics():
        if each.taken_by == "run only":
            with pytest.raises(package.InputError, match=f"metric '{each.name}': "):
                metric_columns([each.name])
        else:
            assert [found.key for found in metric_columns([each.name])] == [each.name]


def test_what_is_scalar_is_a_number_or_true_or_false_in_every_report() -> None:
    """And what is not, is not; so sweeps know it before they run anything."""
    for scene in ("thesis-hold", "couple-unbalance", "weak-motor"):
        report = package.simulate(package.load_scene(scene, ["duration=0.3"])).report()
        for metric in reported_metrics():
            value = report[metric.key]
            if value is not None:
                expected = {MetricKind.NUMBER: (float,), MetricKind.TRUTH: (bool,)}
                assert type(value) in expected.get(metric.kind, (list, dict, str)), metric.key
            assert metric.scalar == (metric.kind in (MetricKind.NUMBER, MetricKind.TRUTH))
