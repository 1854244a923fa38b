"""The base class of all sections of a scene."""

from pydantic import BaseModel, ConfigDict


class Section(BaseModel):
    """A section of a scene: unknown keys are errors, and values are immutable."""

    model_config = ConfigDict(extra="forbid", frozen=True)
