"""Content of a registry: entries by the names with which scenes and reports refer to them."""

from typing import TypeVar

Entry = TypeVar("Entry")


class NamedEntries(dict[str, Entry]):
    """Entries by name, in the order of registration.

    Parameters
    ----------
    kind
        Noun for an entry, such as ``effect``, for messages.
    """

    def __init__(self, kind: str) -> None:
        super().__init__()
        self._kind = kind

    def add(self, name: str, entry: Entry) -> None:
        """Register an entry.

        Raises
        ------
        ValueError
            The name is taken.
        """
        if name in self:
            raise ValueError(f"{self._kind} {name!r} is registered twice")
        self[name] = entry
