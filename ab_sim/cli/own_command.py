"""Name of `ab-sim` in the terminal that called it, for hints."""

import shlex
import shutil
import sys
from pathlib import Path


def own_command() -> str:
    """Return `ab-sim`, or its path, relative if it is below the working directory.

    The path is for environments that are not activated, in which a shell would not find the name.
    """
    script = Path(sys.executable).with_name("ab-sim")
    if (found := shutil.which("ab-sim")) and (not script.exists() or script.samefile(found)):
        return "ab-sim"
    if not script.exists():
        return f"{shlex.quote(sys.executable)} -m ab_sim"
    here = Path.cwd()
    return shlex.quote(str(script.relative_to(here) if script.is_relative_to(here) else script))
