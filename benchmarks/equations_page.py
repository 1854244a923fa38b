"""Generate the formulas in docs/equations.md from the code that computes them.

    python benchmarks/equations_page.py [--out docs]

writes them into equations.md, between its markers.
"""

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from arguments import folder  # noqa: E402

from ab_sim.export.formulas.page import page_from_code  # noqa: E402


def main() -> None:
    """Write the formulas."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=folder, default=Path(__file__).resolve().parents[1] / "docs")
    page = parser.parse_args().out / "equations.md"
    page.write_text(page_from_code(page.read_text(encoding="utf-8")), encoding="utf-8")
    print(f"wrote {page}")


if __name__ == "__main__":
    main()
