"""check_constraints.py: resolve the constraints for each Python and each release of ROS.

Nothing is installed. For each Python, everything that `make` could install must resolve, and each
package must have its version in constraints.txt or in the file of the release.
"""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
PYTHONS = ("3.10", "3.11", "3.12", "3.13", "3.14")
RELEASES = ("kilted", "jazzy")
NAME = re.compile(r"^[\w.-]+", re.MULTILINE)


def names(text: str) -> set[str]:
    """Return the packages in a list of requirements, normalised as in PEP 503."""
    return {re.sub(r"[-_.]+", "-", name).lower() for name in NAME.findall(text)}


def fault(python: str, release: str) -> str:
    """Resolve the constraints for a Python and a release of ROS.

    Return the error of uv, or the packages without a pinned version; empty if there are none.
    """
    files = [ROOT / "constraints.txt", ROOT / f"constraints-{release}.txt"]
    done = subprocess.run(
        [
            *(sys.executable, "-m", "uv", "pip", "compile", "--quiet", "--no-header"),
            *("--no-annotate", "--no-build-isolation", "--cache-dir", ".venv-cache"),
            *("--python", sys.executable, "--python-version", python),
            *("--python-platform", "x86_64-manylinux_2_28"),
            *(f"--extra={extra}" for extra in ("ros", "dev", "docs")),
            *(f"--constraint={file}" for file in files),
            "setup.py",
        ],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    if done.returncode:
        return done.stderr.strip()
    pinned = names("\n".join(file.read_text() for file in files))
    return ", ".join(f"{name} has no version" for name in sorted(names(done.stdout) - pinned))


def main() -> int:
    """Print a line for each Python and release; return 1 if there is a fault."""
    faults = 0
    for python in PYTHONS:
        for release in RELEASES:
            text = fault(python, release)
            faults += bool(text)
            print(f"Python {python}, ROS 2 {release}: {text or 'resolves'}", flush=True)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
