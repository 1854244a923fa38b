"""Progress bar for long work; without a terminal, a line every ten seconds."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
from rich.progress import Progress as Bar

from ab_sim.base.errors import AbSimError, Interrupted
from ab_sim.base.interruption import in_order
from ab_sim.base.presentation import Progress
from ab_sim.cli.outputs import people

EVERY = 10.0
"""Time between two lines of progress, where a bar cannot be shown [s]."""
_SIGNAL_DELAY = 0.3
"""Time to wait after an error for a signal that may have caused it [s]."""


@contextmanager
def progress_bar(name: str) -> Iterator[Progress]:
    """Show a bar that disappears at the end, and yield the callback for its progress.

    Without a terminal, print a line every ``EVERY`` seconds.
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
    with Bar(*columns, console=people, transient=True) as bar:
        task = bar.add_task("", name=name)

        def update(what: str, done: int, total: int) -> None:
            bar.update(task, description=what, completed=done, total=total)

        yield update


@contextmanager
def _lines(name: str) -> Iterator[Progress]:
    """Print progress from a separate thread, because compiling a kernel reports nothing."""
    ended = threading.Event()
    newest: list[tuple[str, int, int]] = []

    def update(what: str, done: int, total: int) -> None:
        newest[:] = [(what, done, total)]

    def print_lines() -> None:
        while not ended.wait(EVERY):
            for what, done, total in newest:
                people.print(f"{name}: {what}, {done} of {total}")

    printing = threading.Thread(target=print_lines, daemon=True)
    printing.start()
    try:
        yield update
    finally:
        ended.set()
        printing.join()


@contextmanager
def interruptible(name: str, kept_files: str) -> Iterator[Progress]:
    """Show a bar, and raise ``Interrupted`` at the next progress report after Ctrl-C.

    Parameters
    ----------
    name
        Name of the work, in front of the bar.
    kept_files
        Text on the files that remain, for the message.
    """
    with in_order() as stopping, progress_bar(name) as show:

        def tell(what: str, done: int, total: int) -> None:
            show(what, done, total)
            if stopping.is_set():
                raise Interrupted(f"interrupted; {kept_files}")

        try:
            yield tell
        except AbSimError as error:
            # Ctrl-C also ends the worker processes. Their exit may be noticed before the signal,
            # which a separate thread handles; it would be reported as an error.
            if stopping.wait(_SIGNAL_DELAY):
                raise Interrupted(f"interrupted; {kept_files}") from error
            raise
