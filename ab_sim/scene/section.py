"""What all sections of a scene have in common."""

from pydantic import BaseModel, ConfigDict


class Section(BaseModel):
    """A part of a scene: unknown keys are errors, values do not change afterwards."""

    model_config = ConfigDict(extra="forbid", frozen=True)
