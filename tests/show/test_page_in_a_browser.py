"""Report on two runs as a page, in a real browser as wide as a telephone and as a screen."""

from pathlib import Path
from typing import Any

import pytest

from ab_sim.drive import Drive
from ab_sim.drive.description import describe
from ab_sim.drive.trajectory import Trajectory
from ab_sim.record.recording import Recording
from ab_sim.scene import load_scene
from tests.cli.tool import ab_sim

pytestmark = pytest.mark.long

PANELS = """() => [...document.querySelectorAll('.runs .js-plotly-plot')].map((panel) => {
    const box = (e) => { const r = e.getBoundingClientRect();
                         return [r.left, r.right, r.top, r.bottom]; };
    const boxes = (what) => [...panel.querySelectorAll(what)].map(box);
    return {title: panel.closest('.runs > div').querySelector('h3').innerText, box: box(panel),
            plot: box(panel.querySelector('.nsewdrag')),
            legend: boxes('.legend .traces'),
            labels: [...panel.querySelectorAll('.annotation-text')]
                .map((e) => [e.textContent, ...box(e)])};
})"""


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a report on two runs; one passes the critical speed, the other stays below it."""
    folder = tmp_path_factory.mktemp("page")
    for name, speed in (("fast", 200), ("slow", 60)):
        changes = [f"profile.target_speed={speed}", "profile.variable_speed_period=", "duration=5"]
        drive = Drive(load_scene("balanced-start-up", changes))
        run = Trajectory.join([drive.present(), drive.advance(5000)])
        with Recording(folder / f"{name}.rrd", description=describe(drive.scene)) as recording:
            recording.block(run.channels, run.samples)
    done = ab_sim("report", "fast.rrd", "slow.rrd", "--html", "report.html", cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder / "report.html"


def test_a_report_on_two_runs_fits_a_telephone_and_labels_the_critical_speed(page: Path) -> None:
    pytest.importorskip("playwright", reason="needs a browser")
    from tests.viewing.browser import browser

    with browser() as screen:
        for width, columns in ((390, 1), (1280, 2)):
            screen.resize(width, 844)
            screen.open(page.as_uri())
            panels = screen.evaluate(PANELS)
            assert screen.sideways() == 0
            assert len({panel["box"][0] for panel in panels}) == columns
            assert all(0 <= panel["box"][0] and panel["box"][1] <= width for panel in panels)
            assert all(panel["box"][1] - panel["box"][0] > 340 for panel in panels)
            names = ["fast", "slow"] if columns == 1 else []
            speeds = [panel for panel in panels if panel["title"].endswith("Spindle speed")]
            assert [panel["title"] for panel in speeds] == (
                [f"{name}: Spindle speed" for name in names] or ["Spindle speed"] * 2
            )
            for panel in speeds:
                (label,) = panel["labels"]
                assert label[0] == "critical speed" and _within(label[1:], panel["plot"])
                assert not any(_overlap(label[1:], entry) for entry in panel["legend"])


def _within(box: Any, other: Any) -> bool:
    return bool(
        other[0] <= box[0] and box[1] <= other[1] and other[2] <= box[2] and box[3] <= other[3]
    )


def _overlap(box: Any, other: Any) -> bool:
    return bool(box[0] < other[1] and other[0] < box[1] and box[2] < other[3] and other[2] < box[3])
