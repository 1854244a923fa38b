"""Text and values from outside, as messages put them: short, and with no terminal codes."""

import unicodedata

MOST = 200
"""Characters of a value that a message quotes."""


def visible(text: str) -> str:
    """A text whose control characters and such are written out; lines stay lines.

    A terminal would obey them: hide, move or paint what stands beside, or turn it round. An
    escape becomes the four characters of its code, as Python writes it.
    """
    if text.isprintable():
        return text
    return "".join(
        c if c.isprintable() or c in "\n\t" or unicodedata.category(c) == "Zs" else ascii(c)[1:-1]
        for c in text
    )


def short(value: object) -> str:
    """A value as Python writes it, shortened."""
    try:
        return shortened(repr(value))
    except ValueError:  # Python writes no int of more than 4300 digits
        return f"<{type(value).__name__} of too many digits to write>"


def shortened(text: str) -> str:
    """A text, its middle left out where it is long."""
    if len(text) <= MOST:
        return text
    half = MOST // 2
    return f"{text[:half]} ... {text[-half:]}"
