"""Text and values from outside, as messages put them: short, and with no terminal codes."""

MOST = 200
"""Characters of a value that a message quotes."""


def short(value: object) -> str:
    """A value as Python writes it, shortened."""
    return shortened(repr(value))


def shortened(text: str) -> str:
    """A text, its middle left out where it is long."""
    if len(text) <= MOST:
        return text
    half = MOST // 2
    return f"{text[:half]} ... {text[-half:]}"
