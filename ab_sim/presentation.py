"""How results show themselves: in a terminal, in a notebook, as a picture and as a data frame.

What a result class says of itself are *facts*, a few words by name, and *columns*, where a table is
natural. What draws it is found by name when it is asked for, as matplotlib is: this module, and
the rooms whose results use it, import neither.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from html import escape
from importlib import import_module
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Protocol, cast

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

DRAWERS = "ab_sim.figures.result_figures"
"""Has a function for each ``_picture`` of a result."""
ROWS = 8
"""Of a table that a notebook shows; the others are counted."""


class Values(Protocol):
    """A column's values: a list, a tuple or a one-dimensional array."""

    def __len__(self) -> int: ...
    def __getitem__(self, index: int, /) -> object: ...


class Column(NamedTuple):
    """A column of a result's table."""

    unit: str | None
    """SI; 1 for numbers without one, None for words."""
    values: Values


Columns = Mapping[str, Column]


class Presented:
    """A result that can be looked at. Not made by users, but inherited from by results."""

    _picture: ClassVar[str] = ""
    """Name of the function of ``ab_sim.figures.result_figures`` that draws it."""
    _rows: ClassVar[int] = ROWS

    def _facts(self) -> Mapping[str, str]:
        """What there is to say of it in a line, by name."""
        raise NotImplementedError

    def _columns(self) -> Columns:
        """Its table, all columns of one length."""
        raise NotImplementedError

    def __repr__(self) -> str:
        said = ", ".join(f"{name} {value}" for name, value in self._facts().items())
        return f"<{type(self).__name__}: {said}>"

    def _repr_html_(self) -> str:
        head = "".join(
            f"<tr><th style='text-align:left'>{escape(name)}</th><td>{escape(value)}</td></tr>"
            for name, value in self._facts().items()
        )
        table = _html(self._columns(), self._rows) if self._rows else ""
        return f"<b>{type(self).__name__}</b><table>{head}</table>{table}"

    def plot(self) -> Figure:
        """Draw it.

        Returns
        -------
        matplotlib.figure.Figure
            To be shown by a notebook, changed, or written with its ``savefig``; what the command
            line's ``--plot`` draws, where it draws this.
        """
        return drawn(self._picture, self)

    def to_dataframe(self) -> DataFrame:
        """Its table as a pandas data frame, one column for each name.

        Returns
        -------
        pandas.DataFrame
            ``attrs["units"]`` has the columns' units by name, SI; None for words.

        Raises
        ------
        ImportError
            pandas is not installed, which ab_sim does not need otherwise.
        """
        return data_frame(self._columns())


class _Draws(Protocol):
    def __call__(self, *results: object) -> Figure: ...


def drawn(picture: str, *results: object) -> Figure:
    """What a function of ``DRAWERS`` draws, or of another module: ``module:function``."""
    module, _, name = picture.rpartition(":")
    draw = cast(_Draws, getattr(import_module(module or DRAWERS), name))
    return draw(*results)


def data_frame(columns: Columns) -> DataFrame:
    """Columns as a pandas data frame; see ``Presented.to_dataframe``."""
    try:
        from pandas import DataFrame
    except ImportError as error:
        raise ImportError(
            "to_dataframe() needs pandas, which is not installed: pip install pandas"
        ) from error
    frame = DataFrame({name: column.values for name, column in columns.items()})
    frame.attrs["units"] = {name: column.unit for name, column in columns.items()}
    return frame


def number(value: float | None, unit: str = "") -> str:
    """A number in a few digits with its unit; a dash where there is none."""
    if value is None:
        return "-"
    return f"{value:.4g} {unit}".rstrip()


def finite_or_none(value: Any) -> Any:
    """A report's values with None in the place of every number that is not finite: JSON has none.

    Args:
        value: a number, text, or lists and mappings of them.
    """
    if isinstance(value, dict):
        return {key: finite_or_none(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [finite_or_none(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def ends(first: float, last: float, unit: str) -> str:
    """From here to there."""
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
    """A name with its unit, if that says something."""
    return name if unit in (None, "1", "-") else f"{name} [{unit}]"


def _cell(value: object) -> str:
    # numpy's floats are Python's, too.
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, Sequence) and not isinstance(value, str):
        return escape(", ".join(f"{x:.4g}" if isinstance(x, float) else str(x) for x in value))
    return "-" if value is None else escape(str(value))
