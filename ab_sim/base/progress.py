"""Type of the callback for the progress of long work."""

from collections.abc import Callable

Progress = Callable[[str, int, int], None]
"""Callback that gets the name of the present work, the finished count and the total count. An
exception that it raises ends the work."""
