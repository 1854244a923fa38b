"""What the gallery's scripts leave: figures, which are shown, and effects, which are forgotten."""

from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
from sphinx_gallery.scrapers import figure_rst

from ab_sim.scene import registry

_OURS = dict(registry.effect_classes())


def figures(block: Any, block_vars: dict[str, Any], gallery_conf: dict[str, Any]) -> str:
    """Write each figure that a script has by a name; as sphinx-gallery calls it, after each block.

    sphinx-gallery itself looks into pyplot, where `plot()` of a result leaves none.
    """
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
    registry._effects = dict(_OURS)
