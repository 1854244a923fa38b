"""Presentation of results: in a terminal, in a notebook, as a picture and as a data frame.

A result class provides *facts*, short texts by name, and may provide *columns* of a table. Its
drawing function is imported by name on use, because matplotlib takes long to import. Conventions
of all outputs are here, too: notation, range of displayed angles, and span of final values.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Protocol, TypeVar, cast

from ab_sim.base.registries import registry

if TYPE_CHECKING:
    import numpy as np

    Angles = TypeVar("Angles", float, np.ndarray)
    from matplotlib.figure import Figure
    from pandas import DataFrame


PAGE = "docs/conventions.md"
ANGLES = f"{PAGE}#angles"
WHIRL = f"{PAGE}#whirl-and-we"
MASSES = f"{PAGE}#where-masses-are"
NOTATION = f"Symbols, signs, angles: {PAGE}"
"""Note under tables, pictures and pages with symbols."""

TURN = 2.0 * math.pi
_LAST_ANGLE = math.radians(30.0)
"""End of the turn in which ball angles are shown [rad]."""

LAST = 0.1
"""Length of the last stretch, over which final values are computed, as a fraction of the run."""


def last_stretch(samples: int) -> int:
    """Return the number of samples at the end of a run over which final values are computed."""
    return max(1, round(LAST * samples))


def in_one_turn(angles: Angles) -> Angles:
    """Shift ball angles [rad] by whole turns into the range from -330 (exclusive) to 30 deg.

    Angles in this range are unchanged. Balls start and rest near the unbalance (0) or opposite to
    it (-180), so they rarely pass the end of the range, 30 deg ahead of the unbalance.
    """
    return angles + TURN * ((_LAST_ANGLE - angles) // TURN)


ROWS = 8
"""Largest number of rows of a table in a notebook; the others are counted."""


class Values(Protocol):
    """Values of a column: a list, a tuple or a one-dimensional array."""

    def __len__(self) -> int: ...
    def __getitem__(self, index: int, /) -> object: ...


class Column(NamedTuple):
    """Column of a result's table."""

    unit: str | None
    """SI unit; 1 for dimensionless numbers, None for texts."""
    values: Values


Columns = Mapping[str, Column]


class Presented:
    """Base class of results that can be displayed; not created by users."""

    _picture: ClassVar[str] = ""
    """Name of the result's picture in ``ab_sim.show.result_figures.DRAWN``."""
    _rows: ClassVar[int] = ROWS

    def _facts(self) -> Mapping[str, str]:
        """Return short facts for one line, by name."""
        raise NotImplementedError

    def _columns(self) -> Columns:
        """Return the columns of the result's table, all of one length."""
        raise NotImplementedError

    def __repr__(self) -> str:
        facts = ", ".join(f"{name} {value}" for name, value in self._facts().items())
        return f"<{type(self).__name__}: {facts}>"

    def _repr_html_(self) -> str:
        head = "".join(
            f"<tr><th style='text-align:left'>{escape(name)}</th><td>{escape(value)}</td></tr>"
            for name, value in self._facts().items()
        )
        table = _html(self._columns(), self._rows) if self._rows else ""
        return f"<b>{type(self).__name__}</b><table>{head}</table>{table}"

    def plot(self) -> Figure:
        """Draw the result.

        Returns
        -------
        matplotlib.figure.Figure
            Figure to show in a notebook, to change, or to write with ``savefig``. It is equal to
            that of the command's ``--plot``, if the command draws this result.
        """
        return drawn(self._picture, self)

    def to_dataframe(self) -> DataFrame:
        """Return the result's table as a pandas data frame.

        Returns
        -------
        pandas.DataFrame
            One column for each name. ``attrs["units"]`` has the SI units by name; None for texts.

        Raises
        ------
        ImportError
            pandas is not installed; nothing else in ab_sim needs it.
        """
        return _data_frame(self._columns())


def drawn(picture: str, *results: object) -> Figure:
    """Return the figure of a result's ``_picture``."""
    return cast("Figure", registry("figures").figure_of(picture, *results))


def _data_frame(columns: Columns) -> DataFrame:
    """Return columns as a pandas data frame; see ``Presented.to_dataframe``."""
    try:
        from pandas import DataFrame
    except ImportError as error:
        raise ImportError(
            "to_dataframe() needs pandas, which is not installed: "
            f"{sys.executable} -m pip install pandas"
        ) from error
    frame = DataFrame({name: column.values for name, column in columns.items()})
    frame.attrs["units"] = {name: column.unit for name, column in columns.items()}
    return frame


def number(value: float | None, unit: str = "") -> str:
    """Return a number in a few digits with its unit; a dash for None."""
    if value is None:
        return "-"
    return f"{value:.4g} {unit}".rstrip()


def finite(report: Mapping[str, Any]) -> dict[str, Any]:
    """Return a report with None in place of non-finite numbers, which JSON does not have.

    If there are any, the entry ``not_finite`` has the reason for each such None, by its place:
    ``{"parameters.0.high": "infinite"}``.
    """
    reasons: dict[str, str] = {}

    def cleaned(value: Any, place: str) -> Any:
        if isinstance(value, dict):
            return {key: cleaned(entry, f"{place}.{key}") for key, entry in value.items()}
        if isinstance(value, list | tuple):
            return [cleaned(entry, f"{place}.{k}") for k, entry in enumerate(value)]
        if not isinstance(value, float) or math.isfinite(value):
            return value
        reason = "not a number" if math.isnan(value) else "infinite"
        reasons[place[1:]] = f"minus {reason}" if value == -math.inf else reason
        return None

    values: dict[str, Any] = cleaned(dict(report), "")
    return values | {"not_finite": reasons} if reasons else values


def ends(first: float, last: float, unit: str) -> str:
    """Return a range as text, with its unit: ``0 to 6 s``."""
    return f"{first:.4g} to {last:.4g} {unit}"


def _html(columns: Columns, rows: int) -> str:
    count = len(next(iter(columns.values())).values) if columns else 0
    if not count:
        return ""
    head = "".join(
        f"<th>{escape(titled(name, column.unit))}</th>" for name, column in columns.items()
    )
    body = "".join(
        "<tr>" + "".join(f"<td>{_cell(c.values[k])}</td>" for c in columns.values()) + "</tr>"
        for k in range(min(rows, count))
    )
    more = f"<p>and {count - rows} more rows</p>" if count > rows else ""
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>{more}"


def titled(name: str, unit: str | None) -> str:
    """Return a name with its unit, if there is one to show."""
    return name if unit in (None, "1", "-") else f"{name} [{unit}]"


def _cell(value: object) -> str:
    # numpy's float64 is a float, too.
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, Sequence) and not isinstance(value, str):
        return escape(", ".join(f"{x:.4g}" if isinstance(x, float) else str(x) for x in value))
    return "-" if value is None else escape(str(value))


Progress = Callable[[str, int, int], None]
"""Callback that gets the name of the current work, the finished count and the total count. An
exception that it raises ends the work."""
CountProgress = Callable[[int, int], None]
"""Callback that gets the finished count and the total count, like ``Progress``."""
