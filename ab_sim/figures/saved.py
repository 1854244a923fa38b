"""Pictures, written such that texts from outside stand in them as they are."""

from io import BytesIO
from pathlib import Path
from typing import TypeVar

from matplotlib.axis import Axis, Tick
from matplotlib.figure import Figure
from matplotlib.text import Text

from ab_sim.errors import InputError
from ab_sim.output_file import write_whole
from ab_sim.quoting import visible


class ResultFigure(Figure):
    """A figure that a notebook shows, also where nothing has told it how to show matplotlib's."""

    def _repr_png_(self) -> bytes:
        drawn = BytesIO()
        self.savefig(drawn, format="png")
        return drawn.getvalue()


Drawn = TypeVar("Drawn", bound=Figure)


def with_plain_texts(figure: Drawn) -> Drawn:
    """The same figure, with texts from outside as they are.

    Names of scenes and files are in its texts: a $ in one begins no formula, and what a font or an
    SVG cannot hold is written out. Only matplotlib's own numbers at the axes are formulas.
    """
    numbers = {id(axis.get_offset_text()) for axis in figure.findobj(Axis)}
    for tick in figure.findobj(Tick):
        numbers |= {id(tick.label1), id(tick.label2)}
    for text in figure.findobj(Text):
        if isinstance(text, Text) and id(text) not in numbers:
            text.set_parse_math(False)
            text.set_text(visible(text.get_text()))
    return figure


def save(figure: Figure, path: Path, dpi: int) -> None:
    """Write a picture, with texts as ``with_plain_texts`` leaves them.

    Args:
        figure: what is drawn.
        path: its ending says the format.
        dpi: dots per inch.

    It is drawn first and then written, so that who is interrupted leaves no half of one.

    Raises:
        InputError: it cannot be written; names it and the reason.
    """
    with_plain_texts(figure)
    drawn = BytesIO()
    figure.savefig(drawn, format=path.suffix[1:].lower(), dpi=dpi)
    try:
        write_whole(path, drawn.getvalue())
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror}") from error
