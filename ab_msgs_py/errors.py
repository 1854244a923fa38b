"""The error that receivers raise for a message that breaks the contract."""


class MalformedMessage(ValueError):
    """Message without the contract's layout; the text names the part and what is expected."""
