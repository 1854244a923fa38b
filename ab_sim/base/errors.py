"""Errors of ab_sim, each with its exit code on the command line, and texts for their messages."""

import difflib
import unicodedata
from collections.abc import Iterable
from decimal import Decimal

NOT_AS_WRITTEN = (
    ArithmeticError,
    AttributeError,
    LookupError,
    RecursionError,
    TypeError,
    ValueError,
)
"""Errors that Python raises if a stored state does not have the form in which it was written."""


class AbSimError(Exception):
    """Base class of the errors that ab_sim raises deliberately; their texts are for users.

    Examples
    --------
    >>> import ab_sim
    >>> issubclass(ab_sim.SceneError, ab_sim.AbSimError)
    True
    """

    exit_code = 2


class SceneError(AbSimError):
    """A scene cannot be used; the text names file, key, value, allowed range and remedy.

    Examples
    --------
    >>> import ab_sim
    >>> ab_sim.load_scene("thesis-hol")
    Traceback (most recent call last):
    ab_sim.base.errors.SceneError: scene 'thesis-hol' is not known; did you mean 'thesis-hold'?; ...
    """


class InputError(AbSimError):
    """An argument of a call or command cannot be used; nothing has been started or written.

    Examples
    --------
    >>> import ab_sim
    >>> ab_sim.simulate("thesis-hold", times=[-1.0])
    Traceback (most recent call last):
    ab_sim.base.errors.InputError: times: -1 s: must be a finite number, at least 0
    """


class CommandError(AbSimError):
    """A command was rejected and has changed nothing."""


class Refused(AbSimError):
    """A node has refused a request; the text is its answer."""

    exit_code = 1


class RecordingError(AbSimError):
    """A recording cannot be written or read.

    Examples
    --------
    >>> import ab_sim
    >>> ab_sim.open_recording("none.rrd")
    Traceback (most recent call last):
    ab_sim.base.errors.RecordingError: ...
    """


class NothingFound(AbSimError):
    """A search has found no acceptable result; the evaluated candidates have been shown."""

    exit_code = 1


class Interrupted(AbSimError):
    """An orderly exit after Ctrl-C or another request; everything has been cleaned up."""

    exit_code = 130


class DivergedError(AbSimError):
    """The simulation diverged; the text has the variable, the time and a likely cause.

    Examples
    --------
    >>> import ab_sim
    >>> scene = ab_sim.load_scene("thesis-hold", ["start.ball_rates=[1e6, 0.0]"])
    >>> ab_sim.Drive(scene).advance(100)
    Traceback (most recent call last):
    ab_sim.base.errors.DivergedError: ...
    """

    exit_code = 3


def exact(value: float) -> str:
    """Return a number as text, for an error, with as many digits as identify it.

    So a value just beyond a limit does not look like the limit. An int that exceeds all floats has
    six digits.
    """
    try:
        short = f"{value:g}"
    except OverflowError:
        return f"{Decimal(value):.6g}"
    return short if float(short) == value else repr(float(value))


def nearest(word: str, candidates: Iterable[str], similarity: float = 0.5) -> str:
    """Return ``; did you mean 'x'?`` for the most similar name, or an empty text; for errors.

    Parameters
    ----------
    word
        Unknown name.
    candidates
        Known names.
    similarity
        Smallest similarity of a suggestion, from 0 to 1 (equal).
    """
    near = difflib.get_close_matches(word, list(candidates), n=1, cutoff=similarity)
    return f"; did you mean {near[0]!r}?" if near else ""


MOST = 200
"""Largest number of characters of a quoted value."""


def visible(text: str) -> str:
    """Return a text with control characters replaced by their codes; line breaks are kept.

    A terminal would execute control characters, which may hide, move, colour or reverse text. The
    codes are in Python's notation; an escape, for example, becomes four characters.
    """
    if text.isprintable():
        return text
    return "".join(
        c if c.isprintable() or c in "\n\t" or unicodedata.category(c) == "Zs" else ascii(c)[1:-1]
        for c in text
    )


def short(value: object) -> str:
    """Return a value in Python's notation, without its middle if it is long."""
    try:
        return shortened(repr(value))
    except ValueError:  # Python does not write an int of more than 4300 digits
        return f"<{type(value).__name__} of too many digits to write>"


def shortened(text: str) -> str:
    """Return a text without its middle if it is long."""
    if len(text) <= MOST:
        return text
    half = MOST // 2
    return f"{text[:half]} ... {text[-half:]}"
