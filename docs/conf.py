"""How Sphinx makes the documentation site: `make docs` writes it to docs/_build/html."""

import re
import sys
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parent
sys.path[:0] = [str(DOCS / "extensions"), str(DOCS.parent)]

import ab_sim  # noqa: E402

project = "ab_sim"
author = "ab_sim maintainers"
copyright = "ab_sim maintainers, Apache-2.0"
version = release = ab_sim.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_design",
    "sphinx_gallery.gen_gallery",
    "from_code",  # in docs/extensions, as the next
    "mathml",
    "narrow",
    "source_links",
]
exclude_patterns = ["_build", "gallery/examples"]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
highlight_language = "text"
smartquotes = False  # psi'' is a derivative

myst_enable_extensions = ["colon_fence", "dollarmath"]
myst_fence_as_directive = ["math"]  # as GitHub has it
myst_heading_anchors = 4  # links to headings are those that GitHub makes
myst_url_schemes = {"http": None, "https": None, "mailto": None}

default_role = "code"  # of `name` in docstrings
autodoc_member_order = "bysource"
autodoc_typehints = "description"

# Scripts in docs/gallery/examples are run, every time; their pages are written to docs/examples.
sphinx_gallery_conf = {
    "examples_dirs": "gallery/examples",
    "gallery_dirs": "examples",
    "run_stale_examples": True,
    "abort_on_example_error": True,
    "image_scrapers": ("gallery_scripts.figures",),
    "capture_repr": ("_repr_html_",),
    "reset_modules": ("matplotlib", "gallery_scripts.forget_effects"),
    "reset_modules_order": "both",
    "within_subsection_order": "FileNameSortKey",
    "download_all_examples": False,
    "write_computation_times": False,
    "show_signature": False,
    "show_memory": False,
    "min_reported_time": 1e9,
}

html_theme = "furo"
html_math_renderer = "mathml"
html_title = f"ab_sim {release}"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_search_summary = False  # a page that is a file may not read others
html_show_sphinx = False


def _docstring(app: Any, what: str, name: str, it: Any, options: Any, lines: list[str]) -> None:
    """Escape |u|, which reStructuredText takes for a substitution; link names of pages."""
    bars = [re.sub(r"(?<!`)\|(?=\S)([^|`]*)(?<=\S)\|", r"\\|\1\\|", line) for line in lines]
    page = re.compile(r"(?<![\w/`])docs/([\w/-]+)\.md")
    lines[:] = [page.sub(r":doc:`docs/\1.md </\1>`", line) for line in bars]


def _of_pydantic(app: Any, what: str, name: str, it: Any, skip: bool, options: Any) -> bool | None:
    return True if name == "model_config" else None


def _no_validators(app: Any, what: str, name: str, *signature: Any) -> None:
    """Drop the types of a scene's fields: they are validators, and reference/scene.md has them."""
    if name == "ab_sim.Scene":
        app.env.current_document.autodoc_annotations.pop(name, None)


def setup(app: Any) -> None:
    """As Sphinx calls it."""
    app.connect("autodoc-process-docstring", _docstring)
    app.connect("autodoc-skip-member", _of_pydantic)
    app.connect("autodoc-process-signature", _no_validators, priority=600)  # after autodoc's own
