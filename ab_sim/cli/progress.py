"""A bar for work that takes a while; where there is no terminal, a line now and then."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from ab_sim.cli.outputs import people
from ab_sim.errors import AbSimError, Interrupted
from ab_sim.interruption import in_order

EVERY = 10.0
"""s between two lines."""
A_MOMENT = 0.3
"""s that a signal may take to be heeded."""
Tell = Callable[[str, int, int], None]
"""What is done now, done, of all."""


@contextmanager
def progress_bar(name: str) -> Iterator[Tell]:
    """Shows a bar, gone at the end; call what it gives with (what is done now, done, of all).

    Without a terminal a line says so every ``EVERY`` seconds.
    """
    if not people.is_terminal:
        with _lines(name) as update:
            yield update
        return
    columns = (
        TextColumn("{task.fields[name]}", markup=False),
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TextColumn("{task.completed} of {task.total}"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=people, transient=True) as bar:
        task = bar.add_task("", name=name)

        def update(what: str, done: int, total: int) -> None:
            bar.update(task, description=what, completed=done, total=total)

        yield update


@contextmanager
def _lines(name: str) -> Iterator[Tell]:
    """From a thread of its own: a kernel may take a minute to compile, and nothing is told then."""
    ended = threading.Event()
    newest: list[tuple[str, int, int]] = []

    def update(what: str, done: int, total: int) -> None:
        newest[:] = [(what, done, total)]

    def speak() -> None:
        while not ended.wait(EVERY):
            for what, done, total in newest:
                people.print(f"{name}: {what}, {done} of {total}")

    speaking = threading.Thread(target=speak, daemon=True)
    speaking.start()
    try:
        yield update
    finally:
        ended.set()
        speaking.join()


@contextmanager
def interruptible(name: str, left: str) -> Iterator[Tell]:
    """A bar whose work ends in order at Ctrl-C, with ``left`` said of what is on disk then."""
    with in_order() as stopping, progress_bar(name) as show:

        def tell(what: str, done: int, total: int) -> None:
            show(what, done, total)
            if stopping.is_set():
                raise Interrupted(f"interrupted; {left}")

        try:
            yield tell
        except AbSimError as error:
            # Who ends all processes of a command means the command. That another one is gone may be
            # seen before the signal, which a thread of its own heeds.
            if stopping.wait(A_MOMENT):
                raise Interrupted(f"interrupted; {left}") from error
            raise
