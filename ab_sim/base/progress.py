"""Progress of long work."""

from collections.abc import Callable

Progress = Callable[[str, int, int], None]
"""Callback for the present work, the finished count and the total. An exception from it ends the
work."""
