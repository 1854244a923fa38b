"""Numbers are written with the digits 0 to 9, wherever a text holds one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

import ab_sim
from ab_sim.analysis.maps.family import values_of
from ab_sim.base.errors import AbSimError
from ab_sim.base.numbers import number_in, whole_number_in
from ab_sim.cli.vibration import drags_of
from ab_sim.design.sizing.specification import SpecificationTexts, specification_of
from ab_sim.drive.faults.fault import faults_of
from ab_sim.identification.mapping import number_of
from tests.cli.tool import ab_sim as command

FIVE = "\u0665"  # of Arabic
SIZES = SpecificationTexts("0.1 kg", 100.0, 200.0, 0.01, 0.002, "0.3 g cm")


@pytest.mark.parametrize(
    "text", [FIVE, f"1{FIVE}", "\uff15", "\u2075", "1_000", "", " ", "5 5", "0x5", "5\u00a0kg"]
)
def test_other_texts_are_no_numbers(text: str) -> None:
    for parse in (number_in, whole_number_in):
        with pytest.raises(ValueError, match="digits|literal|could not"):
            parse(text)


def test_numbers_are_read() -> None:
    assert [number_in(text) for text in ("-1e-3", " 5 ", "+.5", "inf")] == [
        -1e-3,
        5.0,
        0.5,
        float("inf"),
    ]
    assert [whole_number_in(text) for text in ("-7", " 08 ")] == [-7, 8]


@pytest.mark.parametrize(
    "call",
    [
        lambda: ab_sim.load_scene("thesis-hold", [f"duration={FIVE}"]),
        lambda: ab_sim.load_scene("thesis-hold", [f"duration={FIVE} s"]),
        lambda: ab_sim.sweep("thesis-hold", [f"balls.mass=0.001..0.00{FIVE}:3"]),
        lambda: ab_sim.sweep("thesis-hold", [f"balls.mass=0.001..0.003:{FIVE}"]),
        lambda: ab_sim.robust("thesis-hold", [f"balls.mass={FIVE}%"], runs=10),
        lambda: specification_of(SIZES._replace(mass=FIVE)),
        lambda: specification_of(SIZES._replace(balls=FIVE)),
        lambda: specification_of(SIZES._replace(unbalance=None, grade=f"G{FIVE}")),
        lambda: values_of(f"balls.mass={FIVE}"),
        lambda: drags_of(f"0.1:0.5:{FIVE}"),
        lambda: faults_of([f"sensor saturates {FIVE}"]),
        lambda: number_of(FIVE, "m", "gain"),
    ],
)
def test_other_digits_are_refused(call: Callable[[], Any]) -> None:
    with pytest.raises(AbSimError, match=FIVE):
        call()


@pytest.mark.parametrize(
    "words",
    [
        ("robust", "thesis-hold", "--runs", FIVE),
        ("modes", "thesis-hold", f"--speed={FIVE}"),
        ("run", "thesis-hold", "--times", f"1,{FIVE}"),
        ("stability", "thesis-hold", "--map", f"speed=50:{FIVE}00,balls.mass=0.001:0.002"),
    ],
)
def test_a_command_refuses_other_digits(words: tuple[str, ...]) -> None:
    ran = command(*words)
    assert ran.returncode == 2 and FIVE in ran.stderr and "must" in ran.stderr
