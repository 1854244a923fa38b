"""Real browser, Debian's Chromium without a window, and its screen contents."""

import ctypes.util
import io
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import image
from numpy.typing import NDArray
from playwright.sync_api import Page, sync_playwright

RENDERER = (
    ("--use-angle=gl-egl",)  # Mesa's llvmpipe draws five times as fast as SwiftShader
    if ctypes.util.find_library("EGL_mesa")
    else ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")
)
DRAWN_BY_SOFTWARE = ("--use-gl=angle", *RENDERER, "--ignore-gpu-blocklist")
PATIENCE = 240e3
"""Timeout of a picture [ms]; on a quiet machine it takes below a second."""


CUT_OFF = """() => {
    const scrolls = (e) => getComputedStyle(e).overflowX !== 'visible';
    const within = (e) => e.tagName !== 'ARTICLE' && (scrolls(e) || within(e.parentElement));
    document.querySelectorAll('details').forEach((e) => { e.open = true; });
    return [...document.querySelectorAll('article *')]
        .filter((e) => e.getBoundingClientRect().right > innerWidth + 1)
        .filter((e) => e.getBoundingClientRect().width > 0 && !within(e.parentElement))
        .map((e) => e.tagName);
}"""


class Screen:
    """Page in the browser, and the addresses that answered it."""

    def __init__(self, page: Page) -> None:
        self._page = page
        self.answered: set[str] = set()
        page.on("response", lambda response: self.answered.add(response.url))

    def open(self, url: str) -> None:
        self._page.goto(url, timeout=PATIENCE)

    def evaluate(self, script: str) -> Any:
        """Return the value of an expression, or of a function, in JavaScript."""
        return self._page.evaluate(script)

    def resize(self, width: int, height: int) -> None:
        self._page.set_viewport_size({"width": width, "height": height})

    def sideways(self) -> int:
        """Return the distance by which the page can be scrolled sideways [px]."""
        return int(
            self._page.evaluate(
                "document.documentElement.scrollWidth - document.documentElement.clientWidth"
            )
        )

    def cut_off(self) -> list[str]:
        """Return the tags of elements beyond the right edge that are in no scrollable box."""
        return [str(tag) for tag in self._page.evaluate(CUT_OFF)]

    def viewer_state(self) -> bytes:
        """Return the state of Rerun's viewer; empty before it has come up."""
        return bytes(self._page.evaluate("Array.from(window._handle?.viewer_state() ?? [])"))

    def png(self) -> bytes:
        return self._page.screenshot(timeout=PATIENCE)

    def pixels(self) -> NDArray[np.float64]:
        """Return the present picture: rows, columns, red, green and blue from 0 to 255."""
        picture = np.asarray(image.imread(io.BytesIO(self.png()), format="png"), dtype=float)
        return 255.0 * picture[..., :3]


def like(pixels: NDArray[np.float64], color: tuple[int, int, int]) -> NDArray[np.bool_]:
    """Return a mask of pixels with a colour, with a tolerance for smoothed lines."""
    return np.abs(pixels - color).max(axis=-1) <= 24.0


@contextmanager
def browser(width: int = 640, height: int = 420, draws: bool = True) -> Iterator[Screen]:
    """Open a browser that is closed on exit.

    Parameters
    ----------
    width
        Width of the page [px].
    height
        Height of the page [px].
    draws
        Whether pages draw in three dimensions; without, others take two thirds of the time.
    """
    found = shutil.which("chromium") or shutil.which("chromium-browser")
    assert found, f"Chromium is missing: run {Path('tools/install-browser')}"
    with sync_playwright() as play:
        options = DRAWN_BY_SOFTWARE if draws else ("--disable-gpu",)
        chromium = play.chromium.launch(
            executable_path=found,
            args=["--no-sandbox", *options],  # as root there is none
        )
        try:
            page = chromium.new_page(
                viewport={"width": width, "height": height}, color_scheme="dark"
            )
            yield Screen(page)
        finally:
            chromium.close()
