"""Quotation of texts and values from users in messages: short, and without terminal codes."""

import unicodedata

MOST = 200
"""Largest number of characters of a quoted value."""


def visible(text: str) -> str:
    """Return a text with control characters replaced by their codes; line breaks are kept.

    A terminal would execute control characters, which may hide, move, colour or reverse text. The
    codes are in Python's notation; an escape, for example, becomes four characters.
    """
    if text.isprintable():
        return text
    return "".join(
        c if c.isprintable() or c in "\n\t" or unicodedata.category(c) == "Zs" else ascii(c)[1:-1]
        for c in text
    )


def short(value: object) -> str:
    """Return a value in Python's notation, without its middle if it is long."""
    try:
        return shortened(repr(value))
    except ValueError:  # Python does not write an int of more than 4300 digits
        return f"<{type(value).__name__} of too many digits to write>"


def shortened(text: str) -> str:
    """Return a text without its middle if it is long."""
    if len(text) <= MOST:
        return text
    half = MOST // 2
    return f"{text[:half]} ... {text[-half:]}"
