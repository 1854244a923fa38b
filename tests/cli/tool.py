"""`ab-sim` in a process of its own."""

import os
import subprocess
import sys
from pathlib import Path

PNG = b"\x89PNG\r\n"


def ab_sim(*arguments: str, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Run a command, its tables 200 columns wide."""
    root = Path(__file__).resolve().parents[2]
    return subprocess.run(
        [sys.executable, "-m", "ab_sim", *arguments],
        capture_output=True,
        text=True,
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": str(root), "COLUMNS": "200"},
        timeout=280,
    )
