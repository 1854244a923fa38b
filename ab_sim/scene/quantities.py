"""Checked numbers: finite, of a sane size, with the unit kept beside the field."""

from typing import Annotated, Any

from pydantic import BeforeValidator, Field


def _not_a_bool(value: Any) -> Any:
    # YAML reads `yes` and `on` as true, and pydantic would read true as 1.0.
    if isinstance(value, bool):
        raise ValueError("a number is needed, not yes/no")
    return value


Number = Annotated[float, BeforeValidator(_not_a_bool), Field(allow_inf_nan=False)]
Count = Annotated[int, BeforeValidator(_not_a_bool)]


def quantity(meaning: str, unit: str, **bounds: Any) -> Any:
    """A pydantic field with its meaning and SI unit; ``bounds`` are gt, ge, lt, le."""
    return Field(description=meaning, json_schema_extra={"unit": unit}, **bounds)
