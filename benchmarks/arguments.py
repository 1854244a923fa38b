"""Command-line arguments that all measuring benchmarks have in common."""

import argparse
from pathlib import Path


def arguments(description: str, repeats: int) -> argparse.ArgumentParser:
    """Return a parser with output folder, which is created when parsed, and number of repeats."""
    parser = argparse.ArgumentParser(
        description=description, formatter_class=argparse.ArgumentDefaultsHelpFormatter
    )
    docs = Path(__file__).resolve().parents[1] / "docs"
    parser.add_argument("--out", type=folder, default=docs, help="folder for what is written")
    parser.add_argument("--repeats", type=_repeats, default=repeats, help="interleaved repeats")
    return parser


def folder(text: str) -> Path:
    """Return a folder, created if missing."""
    path = Path(text)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise argparse.ArgumentTypeError(f"{text}: {error.strerror}") from error
    return path


def _repeats(text: str) -> int:
    if not (text.isdecimal() and int(text) >= 1):
        raise argparse.ArgumentTypeError(f"{text}: must be a whole number, at least 1")
    return int(text)
