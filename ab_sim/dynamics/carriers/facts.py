"""What is so of all carriers of a kind: attributes of their class, constants of a kernel."""

from collections.abc import Callable
from typing import Any, TypeVar

Class = TypeVar("Class", bound=type[Any])


def carrier(
    *,
    STATES: int,
    UNKNOWNS: int,
    STATE_NAMES: tuple[str, ...],
    NEEDS_ANGLE: bool,
    WAYS: int,
    CHANNELS: tuple[str, ...],
    COORDINATES: int = 0,
) -> Callable[[Class], Class]:
    """Class decorator: make these attributes of a NamedTuple; ``carriers`` says what they mean."""
    # Tuples whose lengths are numbers that compiled code knows: see ``dispatch.number_of``.
    facts = {**locals(), "ALL": (None,) * (UNKNOWNS + 1), "FREE": (None,) * UNKNOWNS}
    facts["SHOWN"] = len(CHANNELS)

    def add(kind: Class) -> Class:
        for name, value in facts.items():
            setattr(kind, name, value)
        return kind

    return add
