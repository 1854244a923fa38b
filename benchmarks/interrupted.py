"""Ctrl-C on a terminal, at random moments, to commands that share their work among processes.

    python benchmarks/interrupted.py [TRIES]

A row for each command and each state in which it was met: how often it ended as it should, with
code 130, one line, and none of its processes left over. Above it each try.
"""

import collections
import contextlib
import os
import pty
import random
import re
import sys
import time
from pathlib import Path

from rich.console import Console
from rich.table import Table

LATEST = 10.0
"""s after its start at which a command is interrupted at the latest."""
STARTING = 4.0
"""The same after its first worker's start; while they import is where this went wrong."""
ENDS = 60.0
"""s, after which it is said not to have ended."""
MAP = "speed=60:500:1000,effects.suspension.damping=1:121:1001"
COMMANDS = {
    "--map": ("--coarse", "1", "--map", MAP),
    "--map --against": ("--coarse", "1", "--map", MAP, "--against", "1"),
    "--map --each": ("--coarse", "1", "--map", MAP, "--each", "balls.mass=0.001,0.002"),
    "--basin": ("--basin", "200"),
}
"""Of `ab-sim stability`: all that share work, each of many minutes."""
LAST = re.compile(rb"(interrupted|ab-sim: interrupted; what is done is kept[^\r\n]*)\r\n$")
WRONG = re.compile(rb"Traceback|Error|Warning|leaked|Broken|ConnectionReset")
CODES = re.compile(rb"\x1b\[[0-9;?]*[A-Za-z]")


def of_session(session: int) -> list[int]:
    """Processes of a session that have not ended."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):  # it may have ended meanwhile
            state, *numbers = stat.read_text().rpartition(") ")[2].split()
            if int(numbers[2]) == session and state != "Z":
                found.append(int(stat.parent.name))
    return found


def interrupted(command: tuple[str, ...], after: float, working: bool) -> tuple[str, str]:
    """Run a command, and interrupt it so long after its start, or its first worker's.

    Returns:
        What it was met in, and what was wrong; nothing if nothing was.
    """
    drag = 0.2 + 1e-9 * random.randrange(10**6)  # that no earlier run has kept
    given = ("stability", "nsc-case-3", "--set", f"effects.viscous_drag.coefficient={drag!r}")
    child, terminal = pty.fork()
    if child == 0:
        os.execv(sys.executable, [sys.executable, "-m", "ab_sim", *given, *command])
    said = bytearray()
    os.set_blocking(terminal, False)

    def read() -> bool:
        """Whether somebody may still write."""
        try:
            part = os.read(terminal, 65536)
        except BlockingIOError:
            time.sleep(0.005)
            return True
        except OSError:  # nobody has it open any more
            return False
        said.extend(part)
        return bool(part)

    begin = time.monotonic()
    while working and len(of_session(child)) < 2 and read():
        begin = time.monotonic()
    while time.monotonic() < begin + after and read():
        pass
    met = len(of_session(child)) - 1
    os.write(terminal, b"\x03")
    while time.monotonic() < begin + after + ENDS and read():
        pass
    while (left := of_session(child)) and time.monotonic() < begin + after + ENDS:
        time.sleep(0.05)
    for number in left:
        os.kill(number, 9)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    os.close(terminal)
    plain = CODES.sub(b"", bytes(said))
    wrong = [f"code {code}"] * (code != 130) + [f"{len(left)} processes left"] * bool(left)
    if WRONG.search(plain) or not LAST.search(plain):
        wrong.append(plain[-3000:].decode(errors="replace"))
    return "alone" if met <= 0 else "with workers", "; ".join(wrong)


def main(tries: int = 20) -> int:
    """Print the table; the exit code says whether all is well."""
    table = Table("ab-sim stability", "met", "tries", "ended as it should")
    console = Console(markup=False)
    all_well = True
    for name, command in COMMANDS.items():
        found: dict[str, list[str]] = collections.defaultdict(list)
        for number in range(tries):
            working = number % 2 == 1
            after = random.uniform(0.0, STARTING if working else LATEST)
            met, wrong = interrupted(command, after, working)
            found[met].append(wrong)
            console.print(f"{name}, {met}, after {after:.2f} s: {wrong or 'ended as it should'}")
        for met, each in sorted(found.items()):
            table.add_row(name, met, str(len(each)), str(each.count("")))
            all_well = all_well and not any(each)
    console.print(table)
    return int(not all_well)


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
