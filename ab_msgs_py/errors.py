"""Error that receivers raise for a message that violates the contract."""


class MalformedMessage(ValueError):
    """Message without the layout of the contract; the text names the part and what is expected."""
