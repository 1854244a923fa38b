"""Numbers in texts, with the digits 0 to 9.

Python's own ``float`` and ``int`` also accept the digits of other scripts, and underscores.
"""

import re

_WRITTEN = re.compile(r"\s*[-+0-9a-zA-Z.]+\s*")


def number_in(text: str) -> float:
    """Return the number in a text; ValueError if it is something else."""
    return float(_checked(text))


def whole_number_in(text: str) -> int:
    """Return the whole number in a text; ValueError if it is something else."""
    return int(_checked(text))


def _checked(text: str) -> str:
    if _WRITTEN.fullmatch(text) is None:
        raise ValueError(f"{text!r} is no number of digits 0 to 9")
    return text
