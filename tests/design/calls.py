"""Functions that tests call in workers."""

import os
import signal
import time
from collections.abc import Sequence
from typing import overload

from ab_sim.base.errors import SceneError


def where(number: int) -> tuple[int, int]:
    return number, os.getpid()


def without_a_package(number: int) -> int:
    """Fail as the effect of a user does whose package is not installed."""
    raise ModuleNotFoundError("No module named 'roads'")


def picky(number: int) -> int:
    if number == 30:
        raise SceneError("start.time 30: must be less")
    return number


def killed(number: int) -> int:
    os.kill(os.getpid(), signal.SIGKILL)
    return number


def slow(seconds: float, number: int) -> int:
    time.sleep(seconds)
    return number


class Lazy(Sequence[int]):
    """Sequence of numbers from 0 that records which of them were requested."""

    def __init__(self, count: int) -> None:
        self._numbers, self.made = range(count), set[int]()

    def __len__(self) -> int:
        return len(self._numbers)

    @overload
    def __getitem__(self, index: int) -> int: ...

    @overload
    def __getitem__(self, index: slice) -> Sequence[int]: ...

    def __getitem__(self, index: int | slice) -> int | Sequence[int]:
        found = self._numbers[index]
        self.made.update([found] if isinstance(found, int) else found)
        return found
