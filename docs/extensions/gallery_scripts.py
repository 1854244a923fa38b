"""What the gallery's scripts leave: figures, which are shown, and effects, which are forgotten."""

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

import ab_sim

_registrations = ExitStack()


def figures(block: Any, block_vars: dict[str, Any], gallery_conf: dict[str, Any]) -> str:
    """Write each figure that a script has by a name; as sphinx-gallery calls it, after each block.

    sphinx-gallery itself looks into pyplot, where `plot()` of a result leaves none.
    """
    from sphinx_gallery.scrapers import figure_rst

    names = block_vars["example_globals"]
    paths = []
    for figure in names.values():
        if isinstance(figure, Figure) and not hasattr(figure, "_in_gallery"):
            path = Path(next(block_vars["image_path_iterator"]))
            figure.savefig(path, dpi=120, bbox_inches="tight")
            figure._in_gallery = True  # type: ignore[attr-defined]
            paths.append(str(path))
    title = (names.get("__doc__") or "").strip().partition("\n")[0]
    return str(figure_rst(paths, gallery_conf["src_dir"], title))


def forget_effects(gallery_conf: dict[str, Any], script: Any) -> None:
    """Scripts run in the process that makes the pages: what one registers is in none of them."""
    _registrations.close()
    _registrations.enter_context(ab_sim.temporary_registrations())


def examples() -> Iterator[str]:
    """A card for each script of the gallery: its picture, its title, and the way to its page."""
    yield from ["Short scripts on the [public API](../reference/python.md).", ""]
    yield from ["::::{grid} 1 2 2 3", ":gutter: 2", ""]
    for script in sorted((Path(__file__).parents[1] / "gallery" / "examples").glob("plot_*.py")):
        title = script.read_text(encoding="utf-8").splitlines()[1]
        picture = f"../examples/images/thumb/sphx_glr_{script.stem}_thumb.png"
        yield from [f":::{{grid-item-card}} {title}", f":link: ../examples/{script.stem}"]
        yield from [":link-type: doc", f":img-top: {picture}", ":::"]
    yield from ["::::", ""]
