"""check_constraints.py: resolve the constraints for each Python, release of ROS and system.

Nothing is installed. For each Python, everything that `make` could install must resolve, and each
package must have its version in constraints.txt or in the file of the release. Without ROS,
everything must have wheels for each system.
"""

import re
import subprocess
import sys
from importlib.metadata import requires
from pathlib import Path

ROOT = Path(__file__).parents[1]
PYTHONS = ("3.10", "3.11", "3.12", "3.13", "3.14")
RELEASES = ("kilted", "jazzy")
SYSTEMS = ("aarch64-manylinux_2_28", "aarch64-apple-darwin", "x86_64-pc-windows-msvc")
UV = (sys.executable, "-m", "uv", "pip", "compile", "--quiet", "--no-header", "--no-annotate")
UV += ("--cache-dir", ".venv-cache", "--python", sys.executable)
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
            *(*UV, "--no-build-isolation", "--python-version", python),
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


def lack_of_wheels(python: str, system: str) -> str:
    """Return the error of uv if a package without ROS has no wheel for a system, else ""."""
    required = [line for line in requires("ab_sim") or () if "extra ==" not in line]
    done = subprocess.run(
        [
            *(*UV, "--only-binary=:all:", "--python-version", python),
            *("--python-platform", system, "--constraint", "constraints.txt", "-"),
        ],
        cwd=ROOT,
        input="\n".join(required),
        capture_output=True,
        text=True,
    )
    return done.stderr.strip() if done.returncode else ""


def main() -> int:
    """Print a line for each Python and release; return 1 if there is a fault."""
    faults = 0
    for python in PYTHONS:
        for release in RELEASES:
            text = fault(python, release)
            faults += bool(text)
            print(f"Python {python}, ROS 2 {release}: {text or 'resolves'}", flush=True)
        for system in SYSTEMS:
            text = lack_of_wheels(python, system)
            faults += bool(text)
            print(f"Python {python}, {system}: {text or 'has wheels'}", flush=True)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
