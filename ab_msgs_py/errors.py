"""What a receiver raises for a message that breaks the contract."""


class MalformedMessage(ValueError):
    """A message does not have the contract's layout; says which part, and what is expected."""
