"""Writing of pictures, with texts from outside shown literally."""

from io import BytesIO
from pathlib import Path
from typing import TypeVar

from matplotlib.axis import Axis, Tick
from matplotlib.figure import Figure
from matplotlib.text import Text

from ab_sim.base.errors import InputError, visible
from ab_sim.base.files import write_whole


class ResultFigure(Figure):
    """Figure that a notebook shows even if matplotlib's display is not configured."""

    def _repr_png_(self) -> bytes:
        drawn = BytesIO()
        self.savefig(drawn, format="png")
        return drawn.getvalue()


Drawn = TypeVar("Drawn", bound=Figure)


def with_plain_texts(figure: Drawn) -> Drawn:
    """Change a figure so that it shows texts from outside literally, and return the figure.

    Texts contain names of scenes and files. A $ in them does not begin a formula, and characters
    that a font or an SVG lacks are written as escapes. Only matplotlib's own axis numbers are
    formulas.
    """
    numbers = {axis.get_offset_text() for axis in figure.findobj(Axis)}
    for tick in figure.findobj(Tick):
        numbers |= {tick.label1, tick.label2}
    for text in figure.findobj(Text):
        if isinstance(text, Text) and text not in numbers:
            text.set_parse_math(False)
            text.set_text(visible(text.get_text()))
    return figure


def save(figure: Figure, path: Path, dpi: int) -> None:
    """Write a picture, with texts as in ``with_plain_texts``.

    The picture is drawn before it is written, so that an interrupt leaves no partial file.

    Parameters
    ----------
    figure
        Figure to write.
    path
        File to write; its ending sets the format.
    dpi
        Resolution [dots per inch].

    Raises
    ------
    InputError
        The file cannot be written; the message states the reason.
    """
    with_plain_texts(figure)
    drawn = BytesIO()
    figure.savefig(drawn, format=path.suffix[1:].lower(), dpi=dpi)
    try:
        write_whole(path, drawn.getvalue())
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror}") from error
