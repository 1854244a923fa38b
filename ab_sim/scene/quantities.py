"""Checked numbers: finite, of a sane size, with the unit kept beside the field."""

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
"""What pydantic puts behind the key of a ``PerBall``; no key of a scene."""


def _one_or_each(value: Any) -> str:
    return EACH if isinstance(value, list | tuple) else ONE


# Told apart by hand: of a plain union pydantic reports why each member does not fit.
PerBall = Annotated[
    Annotated[T, Tag(ONE)] | Annotated[tuple[T, ...], Tag(EACH)], Discriminator(_one_or_each)
]
"""One value for all balls, or one for each."""


class InSchema:
    """Says in JSON Schema what a validator of our own checks; stands beside it in ``Annotated``."""

    def __init__(self, keywords: Mapping[str, Any]) -> None:
        self.keywords = keywords

    def __get_pydantic_json_schema__(
        self, core: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """As pydantic's, with these keywords."""
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
"""xx, yy, zz, and xy, xz, yz where they are not 0; xy is minus the integral of x y dm."""


def quantity(meaning: str, unit: str, **bounds: Any) -> Any:
    """A pydantic field with its meaning and SI unit; ``bounds`` are gt, ge, lt, le."""
    return Field(description=meaning, json_schema_extra={"unit": unit}, **bounds)
