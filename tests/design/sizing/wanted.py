"""Specification of a drive for tests of sizing."""

from typing import Any

from ab_sim.design.sizing.specification import (
    DriveSpecification,
    SpecificationTexts,
    specification_of,
)

DRIVE: dict[str, Any] = {
    "mass": "100 g", "unbalance": "0.3 g cm", "critical_speed": "100 rad/s", "speed": "200 rad/s",
    "race_radius": "12 mm", "race_width": "4 mm",
}  # fmt: skip


def wanted(**changes: Any) -> DriveSpecification:
    """Return the specification of ``DRIVE`` with changes."""
    return specification_of(SpecificationTexts(**{**DRIVE, **changes}))
