"""Base class of a scene's sections, and types of their numbers: finite, bounded, with a unit."""

from collections.abc import Mapping
from typing import Annotated, Any, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    GetJsonSchemaHandler,
    Tag,
)
from pydantic_core import CoreSchema


class Section(BaseModel):
    """A section of a scene: unknown keys are errors, and values are immutable."""

    model_config = ConfigDict(extra="forbid", frozen=True)


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
"""Tags that pydantic adds to the key of a ``PerBall``; a scene's file does not contain them."""


def _one_or_each(value: Any) -> str:
    return EACH if isinstance(value, list | tuple) else ONE


# The tag decides which type applies. Without it, pydantic would report errors for both types.
PerBall = Annotated[
    Annotated[T, Tag(ONE)] | Annotated[tuple[T, ...], Tag(EACH)], Discriminator(_one_or_each)
]
"""One value for all balls, or one for each."""


class InSchema:
    """JSON Schema keywords that describe a validator; placed next to it in ``Annotated``."""

    def __init__(self, keywords: Mapping[str, Any]) -> None:
        self.keywords = keywords

    def __get_pydantic_json_schema__(
        self, core: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """Return pydantic's schema with ``keywords`` added."""
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
"""Moments of inertia xx, yy, zz [kg m^2], and xy, xz, yz if they are not 0.

xy is minus the integral of x y dm.
"""


def quantity(meaning: str, unit: str, **bounds: Any) -> Any:
    """Return a pydantic field with meaning and SI unit; ``bounds`` are gt, ge, lt, le, default."""
    return Field(description=meaning, json_schema_extra={"unit": unit}, **bounds)
