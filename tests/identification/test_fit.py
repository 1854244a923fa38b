"""Drives whose numbers are known are found again from their recordings, within the intervals."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import ab_sim
from ab_sim.analysis.comparison import without_balls
from ab_sim.base.errors import Interrupted
from ab_sim.identification.result import (
    FITS,
    INTERRUPTED,
    MISSING,
    NO_BETTER,
    OFF,
    OPEN,
    Identification,
)
from tests.identification import drives

TRUE = {
    "effects.suspension.stiffness": 1100.0,
    "effects.suspension.damping": 1.7,
    "rotor.eccentricity": 8.5e-5,
    "balls.mass": 6.1e-4,
    "effects.viscous_drag.coefficient": 0.25,
}
DECK = list(TRUE)[:3]
BARE = {name: TRUE[name] for name in DECK}
"""Without the balls their mass is missing: it is what the scene says."""


def covers(found: Identification, name: str, true: float, widths: float = 1.6) -> bool:
    """Whether an interval, made so much wider, holds the truth.

    Of five intervals of 95 % there is one in every fifth set that does not.
    """
    each = found[name]
    half = 0.5 * widths * (each.high - each.low)
    return abs(each.value - true) <= half


def fit_deck(folder: Path, drive: ab_sim.Scene, fit: list[str], **more: Any) -> Identification:
    """From one recording without balls, and a scene that has other numbers."""
    file = drives.bench(folder, drive, "bare", balls=False)
    maps = [drives.mapping(folder)]
    return ab_sim.identify(
        [], drives.scene(), fit, without_balls=[file], maps=maps, propose=False, **more
    )


@pytest.fixture(scope="module")
def blind(tmp_path_factory: pytest.TempPathFactory) -> Identification:
    folder = tmp_path_factory.mktemp("blind")
    drive = drives.scene(TRUE)
    return ab_sim.identify(
        drives.bench(folder, drive, "with"),
        drives.scene(),
        [*TRUE, "rotor.total_mass"],
        without_balls=[drives.bench(folder, drive, "bare", balls=False, seed=1)],
        maps=[drives.mapping(folder)],
    )


def test_a_drive_with_two_balls_is_found_blind(blind: Identification) -> None:
    goals = (1e-3, 4e-3, 2e-3, 1e-2, 2e-2)
    for (name, true), goal in zip(TRUE.items(), goals, strict=True):
        assert covers(blind, name, true), name
        assert blind[name].value == pytest.approx(true, rel=goal)
    angles = [each.value for each in blind.estimates if each.name.startswith("start angle")]
    turned = sorted(math.remainder(angle, 2.0 * math.pi) for angle in angles)
    assert turned == pytest.approx([-2.0, 0.7], abs=0.03)


def test_what_cannot_be_known_is_named_and_held(blind: Identification) -> None:
    (open_,) = blind.knowledge.open
    assert open_.held == "rotor.total_mass" and blind.verdict == OPEN
    assert "only the ratios of" in open_.words and "weigh the deck" in open_.advice
    assert {name for name, _ in open_.parts} == {
        *("effects.suspension.stiffness", "effects.suspension.damping", "rotor.total_mass"),
        *("balls.mass", "effects.viscous_drag.coefficient"),
    }
    mass = blind["rotor.total_mass"]
    assert mass.value == 0.1 and (mass.low, mass.high) == (-math.inf, math.inf)
    best = blind.proposals[0]
    assert best.name == "trial mass" and best.opens == ("rotor.total_mass",)
    assert best.gains.startswith("rotor.total_mass: unknown -> ") and best.gains.endswith(" %")
    assert best.opened[0] < 0.1


def test_residuals_of_a_true_model_are_white(blind: Identification) -> None:
    assert all(each.judged and each.white for each in blind.whiteness)
    assert [each.share for each in blind.whiteness] == pytest.approx([0.01, 0.01], rel=0.05)
    assert not blind.tried


def test_the_fitted_scene_runs_and_says_how_sure_it_is(
    blind: Identification, tmp_path: Path
) -> None:
    file = tmp_path / "fitted.yaml"
    file.write_text(blind.scene_text())
    assert "rotor.total_mass = 0.1 kg, open: any value fits" in file.read_text()
    scene = ab_sim.load_scene(file, ["duration=0.1"])
    assert scene.balls.mass == blind["balls.mass"].value
    starts = [blind[f"start angle of ball {ball} of with"].value for ball in (0, 1)]
    assert list(scene.start.ball_angles) == starts
    assert "the fitted scene's balls start where those of with did" in blind.notes
    assert "# equal balls cannot be told apart" in file.read_text()
    assert len(ab_sim.simulate(scene).trajectory) == 101
    report = blind.report()
    assert report["parameters"][5]["low"] is None and report["verdict"] == OPEN


def test_a_recording_of_a_simulation_is_fitted_to_rounding(tmp_path: Path) -> None:
    """Through the recorder's own file, with the steps that the run was made with."""
    file = tmp_path / "bare.rrd"
    ab_sim.save_recording(ab_sim.simulate(without_balls(drives.scene(BARE))), file)
    found = ab_sim.identify(file, drives.scene(), DECK, propose=False)
    assert found.verdict == FITS and not found.whiteness[0].judged
    for name in DECK:
        assert found[name].value == pytest.approx(TRUE[name], rel=1e-7)


def test_noise_of_an_accelerometer_is_whitened(tmp_path: Path) -> None:
    """Behind its low-pass at 200 Hz it is not white, and would look like a missing effect."""
    sensors = {"pickup": {"bandwidth": 200.0, "noise_density": 3e-3}}
    drive = drives.scene({**BARE, "sensors": sensors})
    file = tmp_path / "felt.rrd"
    ab_sim.save_recording(ab_sim.simulate(without_balls(drive)), file)
    found = ab_sim.identify(file, drives.scene(), DECK, propose=False)
    assert found.comparisons[0].measured.kind == "acceleration"
    assert found.verdict == FITS and found.whiteness[0].judged
    for name in DECK:
        assert covers(found, name, TRUE[name]), name


def test_a_proximity_probe_is_a_recording_of_the_displacement(tmp_path: Path) -> None:
    probes = {"probes": {"gap": {"bandwidth": 300.0, "noise_density": 3e-8}}}
    file = tmp_path / "gap.rrd"
    drive = without_balls(drives.scene({**BARE, **probes}))
    ab_sim.save_recording(ab_sim.simulate(drive), file)
    found = ab_sim.identify(file, drives.scene(), DECK, propose=False)
    measured = found.comparisons[0].measured
    assert measured.kind == "displacement" and measured.sensor is not None
    assert found.verdict == FITS
    for name in DECK:
        assert covers(found, name, BARE[name]), name


def test_a_missing_effect_is_flagged_and_named(tmp_path: Path) -> None:
    """A cubic spring, of which the residuals' size says nothing."""
    cubic = {"effects.hardening_suspension": {"cubic_stiffness": 2e7}}
    found = fit_deck(tmp_path, drives.scene({**BARE, **cubic}), DECK)
    (white,) = found.whiteness
    assert found.verdict == MISSING and white.z > 4.0
    assert white.share < 0.0108
    assert found.tried[0].name == "hardening_suspension"
    # Without balls nothing is tried that acts on balls.
    assert {each.name for each in found.tried if not each.nuisance} == {
        "hardening_suspension",
        "unequal_suspension",
        "gravity",
    }
    assert found.tried[0].values["effects.hardening_suspension.cubic_stiffness"] == pytest.approx(
        2e7, rel=0.1
    )
    assert any(
        "hardening_suspension would explain the residuals" in reason for reason in found.reasons
    )
    (hint,) = (reason for reason in found.reasons if reason.startswith("to fit it: "))
    key = "effects.hardening_suspension.cubic_stiffness"
    assert hint.endswith(f" --fit {','.join([*DECK, key])}")
    changed = ab_sim.load_scene("no-ball", [hint.split()[4]])
    assert changed.effects["hardening_suspension"].cubic_stiffness == pytest.approx(2e7, rel=0.1)


def test_gain_and_eccentricity_cannot_be_told_apart_without_balls(tmp_path: Path) -> None:
    found = fit_deck(tmp_path, drives.scene(TRUE), DECK, free=["gain"])
    (open_,) = found.knowledge.open
    assert "only the product of" in open_.words and "calibrate the sensor" in open_.advice
    assert open_.held == "gain of bare" and found["gain of bare"].value == 1.0


def test_a_trial_mass_tells_the_deck_s_mass(tmp_path: Path) -> None:
    drive = drives.scene({**BARE, "rotor.total_mass": 0.108})
    heavier = drives.scene(
        {**BARE, "rotor.total_mass": 0.113, "rotor.eccentric_mass": 0.108 - 2 * 5.5e-4}
    )
    files = [
        drives.bench(tmp_path, drive, "bare", balls=False),
        drives.bench(tmp_path, heavier, "trial", balls=False, seed=1),
    ]
    found = ab_sim.identify(
        [], drives.scene(), [*DECK, "rotor.total_mass"], without_balls=files,
        maps=[drives.mapping(tmp_path)], trial_masses={"trial": 0.005}, propose=False,
    )  # fmt: skip
    assert found.verdict == FITS and not found.knowledge.open
    assert covers(found, "rotor.total_mass", 0.108)
    assert found["rotor.total_mass"].value == pytest.approx(0.108, rel=0.01)


def test_bias_delay_and_disc_angle_are_found(tmp_path: Path) -> None:
    """The sensor is 3 ms late and off by 0.05 mm, and the encoder's zero is 20 deg off."""
    table = drives.recorded(drives.scene(BARE), balls=False)
    for name in ("ch1", "ch2"):
        table[name] = np.concatenate([table[name][:3], table[name][:-3]])
    table["ch1"] += 0.05
    table["encoder"] += 20.0
    found = ab_sim.identify(
        [], drives.scene(), DECK, without_balls=[drives.write(table, tmp_path / "late.csv")],
        maps=[drives.mapping(tmp_path)], free=["bias", "delay", "disc_angle"], propose=False,
    )  # fmt: skip
    assert found.verdict == FITS
    own = {"bias 1": 5e-5, "bias 2": 0.0, "delay": 3e-3}
    for name, true in own.items():
        assert covers(found, f"{name} of late", true), name
    assert covers(found, "encoder zero", -math.radians(20.0))
    for name in DECK:
        assert covers(found, name, BARE[name]), name


def test_held_out_data_can_say_that_a_fit_has_not_helped(tmp_path: Path) -> None:
    """The other recording is of the drive as the scene has it, and not of the fitted one."""
    other = drives.bench(tmp_path, drives.scene(), "other", balls=False, seed=2)
    bare = without_balls(drives.scene())
    file = drives.bench(tmp_path, drives.scene(TRUE), "bare", balls=False)
    found = ab_sim.identify(
        file, bare, DECK, maps=[drives.mapping(tmp_path)], hold_out=[other], propose=False
    )
    assert found.held_out is not None and not found.held_out.better
    assert found.verdict == NO_BETTER
    assert [each.held_out for each in found.comparisons] == [False, True]


def test_interrupted_it_gives_the_best_so_far_marked_as_such(tmp_path: Path) -> None:
    calls = []

    def tell(what: str, done: int, of: int) -> None:
        calls.append(what)
        if what.startswith("start angles") and done == 2:
            raise Interrupted("interrupted")

    drive = drives.scene(TRUE)
    found = ab_sim.identify(
        drives.bench(tmp_path, drive, "with"), drives.scene(), list(TRUE),
        without_balls=[drives.bench(tmp_path, drive, "bare", balls=False, seed=1)],
        maps=[drives.mapping(tmp_path)], progress=tell,
    )  # fmt: skip
    assert found.verdict == INTERRUPTED and "interrupted" in found.reasons[0]
    assert found["rotor.eccentricity"].value == pytest.approx(8.5e-5, rel=1e-2)


def test_interrupted_in_the_last_fit_it_gives_that_one_s_best(tmp_path: Path) -> None:
    calls = []

    def tell(what: str, done: int, of: int) -> None:
        calls.append(what)
        if calls.count("all recordings") == 2:
            raise Interrupted("interrupted")

    found = fit_deck(tmp_path, drives.scene(TRUE), DECK, progress=tell)
    assert found.verdict == INTERRUPTED and calls[-1] == "all recordings"
    assert found["rotor.eccentricity"].value == pytest.approx(8.5e-5, rel=1e-2)


def test_the_same_seed_gives_the_same_answer(tmp_path: Path) -> None:
    runs = [fit_deck(tmp_path, drives.scene(TRUE), DECK, seed=3).report() for _ in range(2)]
    assert runs[0] == runs[1]


def test_a_wrong_gain_is_asked_about_and_fits_nothing(tmp_path: Path) -> None:
    """Signals thirty times too large: the eccentricity goes to its bound, which is ten times."""
    table = drives.recorded(drives.scene(), balls=False)
    for name in ("ch1", "ch2"):
        table[name] *= 30.0
    found = ab_sim.identify(
        [], drives.scene(), ["rotor.eccentricity"],
        without_balls=[drives.write(table, tmp_path / "wrong.csv")],
        maps=[drives.mapping(tmp_path)], propose=False,
    )  # fmt: skip
    reasons = " ".join(found.reasons)
    assert found.verdict == OFF and found["rotor.eccentricity"].at_bound
    assert "wrong: its signals are 3 times the fitted ones all along" in reasons
    assert "unit and the sensor's gain" in reasons and "changed or broken" not in reasons


def test_a_run_far_below_the_critical_speed_is_told(tmp_path: Path) -> None:
    slow = {"profile": {"kind": "start_up", "acceleration": 40.0, "target_speed": 20.0}}
    found = fit_deck(tmp_path, drives.scene({**BARE, **slow}), DECK)
    (note,) = found.notes
    assert note.startswith("bare: never comes near the critical speed") and "20 rad/s" in note
