"""Find changes of a single operator, comparison or number that no test detects.

cosmic-ray lists the possible changes of a file. A separate process runs the tests of the file's
room on each such mutant until a test fails. No file on disk is changed: formulas are traced from
the mutant in the process, and code that is compiled from its source reads the mutant's text.

    .venv/bin/pip install cosmic-ray==8.7.0
    .venv/bin/python benchmarks/mutations.py --json out/mutations.json [ROOM ...]
"""

import argparse
import importlib
import json
import linecache
import os
import random
import re
import resource
import signal
import sys
from collections import Counter, deque
from collections.abc import Iterator
from importlib.machinery import SourceFileLoader
from pathlib import Path
from typing import NamedTuple

import pytest
from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.plugins import get_operator, operator_names

DECK = "tests/analysis/test_deck.py::test_metrics_of_a_deck"
ROOMS = {
    "equations": (
        "ab_sim/model/equations/*.py",
        ["tests/events/test_elimination.py", "tests/dynamics", "tests/effects/test_laws.py"],
    ),
    "events": ("ab_sim/engine/events/*.py", ["tests/events", "tests/stepping"]),
    "effects": (
        "ab_sim/model/equations/effects/*.py",
        [
            "tests/effects/test_laws.py",
            "tests/effects/test_parameters.py",
            "tests/effects/test_against_reference.py",
        ],
    ),
    "spindle": ("ab_sim/model/spindle/*.py", ["tests/spindle"]),
    "metrics": (
        "ab_sim/analysis/metrics/accumulators.py",
        ["tests/analysis/test_metrics.py", DECK],
    ),
    "command_path": ("ab_sim/nodes/command_path.py", ["tests/nodes/test_command_path.py"]),
    "pacing": ("ab_sim/nodes/pacing.py", ["tests/nodes/test_pacing.py"]),
    "inbox": ("ab_sim/nodes/inbox.py", ["tests/nodes/test_inbox.py"]),
    "bags": ("ab_sim/record/bags/*.py", ["tests/bags", "-k", "not command"]),
    "control": (
        "ab_sim/control/*.py",
        ["tests/control", "--ignore=tests/control/test_on_a_board.py"],
    ),
    "faults": (
        "ab_sim/drive/faults/*.py",
        ["tests/drive/test_faults.py", "tests/drive/test_faults_in_use.py"],
    ),
    "design": (
        "ab_sim/design/*.py",
        ["tests/design", "-k", "not grid and not cluster and not shared and not most_drives"],
    ),
    "scheduling": ("ab_sim/tracing/scheduling.py", ["tests/tracing/test_scheduling.py"]),
    "stepping": (
        "ab_sim/engine/stepping/*.py",
        ["tests/stepping", "tests/integrate/test_dips.py", "tests/integrate/test_imex8.py"],
    ),
    "taylor": ("ab_sim/engine/taylor/*.py", ["tests/taylor"]),
    "compiling": ("ab_sim/engine/compiling/*.py", ["tests/compiling"]),
    "batch": ("ab_sim/design/batch/*.py", ["tests/batch"]),
    "scene": ("ab_sim/scene/model.py", ["tests/scene"]),
    "output_file": ("ab_sim/record/recording/output_file.py", ["tests/recording/test_errors.py"]),
    "base": (
        "ab_sim/base/*.py",
        [
            "tests/test_output_file.py",
            "tests/test_quoting.py",
            "tests/test_sources.py",
            "tests/test_written_numbers.py",
            "tests/show/test_colours.py",
            "tests/scene/test_limited_yaml.py",
            "tests/test_workers.py",
        ],
    ),
}
"""Mutated files and arguments of pytest, by room."""
OPERATORS = re.compile(
    "core/("
    "ReplaceBinaryOperator_(Add_Sub|Sub_Add|Mul_Div|Div_Mul|FloorDiv_Mul|Mod_Mul|Pow_Mul)"
    "|ReplaceComparisonOperator_(Eq_NotEq|NotEq_Eq|Is_IsNot|IsNot_Is|Lt_LtE|Lt_GtE|LtE_Lt|LtE_Gt"
    "|Gt_GtE|Gt_LtE|GtE_Gt|GtE_Lt)"
    "|ReplaceUnaryOperator_Delete_.*|AddNot|NumberReplacer|ZeroIterationForLoop|ExceptionReplacer"
    "|ReplaceTrueWithFalse|ReplaceFalseWithTrue|ReplaceAndWithOr|ReplaceOrWithAnd"
    "|ReplaceBreakWithContinue|ReplaceContinueWithBreak)"
)
"""Operators of cosmic-ray: one replacement for each operator, two for each comparison.

cosmic-ray has eleven replacements for each, most of which are as easily detected. Removal of
decorators is left out, because the first call then fails.
"""
PRELOADED = (
    "numpy llvmlite.binding scipy.integrate scipy.optimize "
    "scipy.interpolate scipy.spatial.transform matplotlib.figure pydantic yaml "
    "hypothesis"
)
"""Modules that are imported once, before processes are forked."""


class Mutant(NamedTuple):
    """Place in a file and its change."""

    path: str
    line: int
    operator: str
    occurrence: int

    def source(self) -> str:
        """Return the file's text with the change."""
        operator = get_operator(f"core/{self.operator}")()
        changed = mutate_code(
            Path(self.path).read_text(encoding="utf-8"), operator, self.occurrence
        )
        assert changed is not None
        return changed

    def shown(self) -> str:
        """Return the changed line."""
        pairs = zip(
            Path(self.path).read_text(encoding="utf-8").splitlines(),
            self.source().splitlines(),
            strict=True,
        )
        return next((new.strip() for old, new in pairs if old != new), "")


def mutants_of(path: Path) -> Iterator[Mutant]:
    """Yield all mutants of a file."""
    tree = get_ast(path.read_text(encoding="utf-8"))
    for name in filter(OPERATORS.fullmatch, operator_names()):
        operator = get_operator(name)()
        places = (
            start for node in ast_nodes(tree) for start, _ in operator.mutation_positions(node)
        )
        for occurrence, (line, _) in enumerate(places):
            yield Mutant(str(path), line, name.removeprefix("core/"), occurrence)


def start(mutant: Mutant | None, tests: list[str], patience: int) -> int:
    """Start a process that exits with 0 if the tests pass on a mutant (None: on the sources)."""
    child = os.fork()
    if child:
        return child
    # Of the processor's time, for a machine may be busy: SIGXCPU ends it.
    resource.setrlimit(resource.RLIMIT_CPU, (patience, patience + 1))
    quiet = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1, 2):
        os.dup2(quiet, stream)
    if mutant is not None:
        module, source = mutant.path.removesuffix(".py").replace("/", "."), mutant.source()
        from_disk = SourceFileLoader.get_code

        def get_code(loader: SourceFileLoader, name: str):  # type: ignore[no-untyped-def]
            if name == module:
                return compile(source, mutant.path, "exec")
            return from_disk(loader, name)

        SourceFileLoader.get_code = get_code  # type: ignore[method-assign,assignment]
        # Where translation to machine code looks for a function's source.
        path, lines = str(Path(mutant.path).resolve()), source.splitlines(keepends=True)
        for name in (mutant.path, path):
            linecache.cache[name] = len(source), None, lines, name
    os._exit(int(pytest.main(["-x", "-q", "-p", "no:cacheprovider", *tests])))


def outcomes(
    mutants: list[Mutant], tests: list[str], jobs: int, patience: int
) -> Iterator[tuple[Mutant, str]]:
    """Yield each mutant with "killed", "timeout" or "survived", in the order of completion."""
    waiting, running = deque(mutants), dict[int, Mutant]()
    while waiting or running:
        while waiting and len(running) < jobs:
            mutant = waiting.popleft()
            running[start(mutant, tests, patience)] = mutant
        child, status = os.wait()
        late = os.WIFSIGNALED(status) and os.WTERMSIG(status) in (signal.SIGXCPU, signal.SIGKILL)
        yield running.pop(child), "timeout" if late else "killed" if status else "survived"


def main() -> None:
    """Run the requested rooms, and print a table and the surviving mutants."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("rooms", nargs="*", metavar="ROOM", help=f"of {', '.join(ROOMS)}")
    parser.add_argument("--jobs", type=int, default=1, help="processes at once")
    parser.add_argument("--patience", type=int, default=120, help="CPU seconds for each")
    parser.add_argument("--random", type=int, metavar="N", help="N random mutants of each room")
    parser.add_argument("--file", default="", help="only files whose path contains this")
    parser.add_argument("--again", type=Path, help="only what survived in this earlier --json")
    parser.add_argument("--json", type=Path, help="write every mutant's outcome there")
    asked = parser.parse_args()
    sys.path.insert(0, os.getcwd())
    # Else every process would compile all that it imports.
    sys.dont_write_bytecode = False
    for name in PRELOADED.split():
        importlib.import_module(name)
    before = json.loads(asked.again.read_text()) if asked.again else None
    found: list[dict[str, object]] = []
    for room in asked.rooms or ROOMS:
        pattern, tests = ROOMS[room]
        files = [path for path in sorted(Path().glob(pattern)) if asked.file in str(path)]
        mutants = [mutant for path in files for mutant in mutants_of(path)]
        if asked.random:
            mutants = random.Random(0).sample(mutants, min(asked.random, len(mutants)))
        if before is not None:
            alive = {
                (e["path"], e["operator"], e["occurrence"])
                for e in before
                if e["outcome"] == "survived"
            }
            mutants = [m for m in mutants if (m.path, m.operator, m.occurrence) in alive]
        if os.waitpid(start(None, tests, asked.patience), 0)[1]:
            sys.exit(f"{room}: its tests fail on the sources as they are: {' '.join(tests)}")
        for mutant, outcome in outcomes(mutants, tests, asked.jobs, asked.patience):
            found.append({"room": room, **mutant._asdict(), "outcome": outcome})
            if outcome == "survived":
                print(f"{mutant.path}:{mutant.line} {mutant.operator}: {mutant.shown()}")
                sys.stdout.flush()
            if asked.json:
                asked.json.write_text(json.dumps(found, indent=0) + "\n")
    counts = Counter((entry["path"], entry["outcome"]) for entry in found)
    for path in sorted({path for path, _ in counts}):
        kinds = [counts[path, kind] for kind in ("killed", "timeout", "survived")]
        print(f"| {path} | {sum(kinds)} | {kinds[0] + kinds[1]} | {kinds[2]} |")


if __name__ == "__main__":
    main()
