"""Checked numbers: finite, of a sane size, with the unit in the field."""

from collections.abc import Mapping
from typing import Annotated, Any, TypeVar

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Discriminator,
    Field,
    GetJsonSchemaHandler,
    Tag,
)
from pydantic_core import CoreSchema

T = TypeVar("T")


def _not_a_bool(value: Any) -> Any:
    # YAML reads `yes` and `on` as true, and pydantic would read true as 1.0.
    if isinstance(value, bool):
        raise ValueError("a number is needed, not yes/no")
    return value


Number = Annotated[float, BeforeValidator(_not_a_bool), Field(allow_inf_nan=False)]
Length = Annotated[Number, Field(ge=-10, le=10)]
Count = Annotated[int, BeforeValidator(_not_a_bool)]

ONE, EACH = "<one>", "<each>"
"""Tags that pydantic adds to the key of a ``PerBall``; no keys of a scene."""


def _one_or_each(value: Any) -> str:
    return EACH if isinstance(value, list | tuple) else ONE


# Told apart by a tag: for a plain union, pydantic reports why each member does not fit.
PerBall = Annotated[
    Annotated[T, Tag(ONE)] | Annotated[tuple[T, ...], Tag(EACH)], Discriminator(_one_or_each)
]
"""One value for all balls, or one for each."""


class InSchema:
    """JSON Schema keywords for a validator of our own; stands next to it in ``Annotated``."""

    def __init__(self, keywords: Mapping[str, Any]) -> None:
        self.keywords = keywords

    def __get_pydantic_json_schema__(
        self, core: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """Return pydantic's schema with these keywords added."""
        return {**handler(core), **self.keywords}


def _three_or_six(inertia: tuple[float, ...]) -> tuple[float, ...]:
    if len(inertia) not in (3, 6):
        raise ValueError(
            f"has {len(inertia)} numbers; give [xx, yy, zz], or [xx, yy, zz, xy, xz, yz]"
        )
    return inertia


Vector = tuple[Number, Number, Number]
Inertia = Annotated[
    tuple[Number, ...],
    AfterValidator(_three_or_six),
    InSchema({"minItems": 3, "maxItems": 6, "not": {"minItems": 4, "maxItems": 5}}),
]
"""Moments xx, yy, zz, and xy, xz, yz if they are not 0; xy is minus the integral of x y dm."""


def quantity(meaning: str, unit: str, **bounds: Any) -> Any:
    """Return a pydantic field with meaning and SI unit; ``bounds`` are gt, ge, lt, le."""
    return Field(description=meaning, json_schema_extra={"unit": unit}, **bounds)
