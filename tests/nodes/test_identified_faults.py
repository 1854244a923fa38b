"""A drive breaks while the live recorder listens: identified afterwards, its signs are told."""

from pathlib import Path

import pytest

import ab_sim
from ab_sim.analysis.comparison import without_balls
from ab_sim.base.errors import InputError
from ab_sim.identification.result import OFF
from tests.nodes.faulty_recordings import AT, bench, recorded_live

pytestmark = [pytest.mark.ros, pytest.mark.long]


def test_what_breaks_while_it_is_recorded_is_told(tmp_path: Path) -> None:
    """Others one by one: benchmarks/identification_faults.py."""
    faults = ["suspension softens 0.7", "pickup saturates 0.5"]
    live = recorded_live(tmp_path, without_balls(bench()), faults, "live")
    fit = ["effects.suspension.stiffness", "effects.suspension.damping", "rotor.eccentricity"]
    scene = without_balls(bench())

    # The recorder has the drive as it is, and no saturated reading.
    found = ab_sim.identify(live.recording, scene, fit, propose=False)
    assert found.verdict == OFF
    (sign,) = (reason for reason in found.reasons if "fits until" in reason)
    assert float(sign.partition("until ")[2].split()[0]) == pytest.approx(AT, abs=0.05), sign
    (note,) = found.notes
    assert note.endswith(f"the recorder noted faults: {', '.join(faults)}, from {AT:g} s on")

    # A firmware heard the sensor.
    with pytest.raises(InputError, match="is clipped: .* -?0.5 for 3") as told:
        ab_sim.identify(live.heard, scene, fit)
    first = str(told.value).partition("the first at ")[2].split()[0]
    # Its times are from its own first sample on.
    assert float(first) == pytest.approx(AT, abs=0.05) and "\n" not in str(told.value)
