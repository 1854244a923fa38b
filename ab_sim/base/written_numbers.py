"""Conversion of texts to numbers, with the digits 0 to 9 only.

Python's ``float`` and ``int`` also accept underscores, and digits of other scripts.
"""

import re

_WRITTEN = re.compile(r"\s*[-+0-9a-zA-Z.]+\s*")


def number_in(text: str) -> float:
    """Return the number in a text.

    Raises:
        ValueError: the text is not a number.
    """
    return float(_checked(text))


def whole_number_in(text: str) -> int:
    """Return the whole number in a text.

    Raises:
        ValueError: the text is not a whole number.
    """
    return int(_checked(text))


def _checked(text: str) -> str:
    if _WRITTEN.fullmatch(text) is None:
        raise ValueError(f"{text!r} is not a number with the digits 0 to 9")
    return text
