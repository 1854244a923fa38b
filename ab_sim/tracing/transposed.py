"""Numbers in lanes written line by line: a line of memory for each lane, in LLVM's language."""

from collections.abc import Sequence

from ab_sim.tracing.llvm_text import Function, kind

WIDTH = 8
"""Lanes that are turned at once."""


def lines_of(into: Function, columns: Sequence[str]) -> list[list[tuple[int, str]]]:
    """Numbers that are in lanes, lane by lane.

    Args:
        into: the function.
        columns: names of values in lanes.

    Returns:
        For each lane the values that make up its line: how many numbers, and the value.
    """
    lanes = into.shape.lanes
    width = min(WIDTH, lanes)
    found: list[list[tuple[int, str]]] = [[] for _ in range(lanes)]
    for first in range(0, len(columns), width):
        group = list(columns[first : first + width])
        for lane in range(0, lanes, width):
            part = range(lane, lane + width)
            square = [x if lanes == width else into.shuffled(x, lanes, part) for x in group]
            square += ["poison"] * (width - len(group))
            for k, line in enumerate(_transposed(into, square)):
                found[lane + k] += _cut(into, line, width, len(group))
    return found


def store_line(
    into: Function, line: Sequence[tuple[int, str]], pointer: str, first: int = 0
) -> None:
    """Write one of these lines from so many numbers behind a pointer on, an LLVM name of one."""
    for count, value in line:
        place = into.put(f"getelementptr double, ptr {pointer}, i64 {first}")
        into.lines.append(f"store {kind(count)} {value}, ptr {place}, align 8")
        first += count


def _transposed(into: Function, square: Sequence[str]) -> list[str]:
    """As many vectors as they have elements: blocks beside the diagonal change places."""
    lines, width = list(square), len(square)
    d = width // 2
    while d:
        for i in range(width):
            if not i & d:
                a, b = lines[i], lines[i + d]
                high = [p if not p & d else width + p - d for p in range(width)]
                low = [p + d if not p & d else width + p for p in range(width)]
                lines[i], lines[i + d] = (into.shuffled(a, width, w, b) for w in (high, low))
        d //= 2
    return lines


def _cut(into: Function, value: str, width: int, count: int) -> list[tuple[int, str]]:
    """The first numbers of a vector, in pieces that machines store at once."""
    if count == width:
        return [(width, value)]
    found, first, size = [], 0, width // 2
    while size:
        if count & size:
            which = range(first, first + size)
            piece = (
                into.put(f"extractelement {kind(width)} {value}, i32 {first}")
                if size == 1
                else into.shuffled(value, width, which)
            )
            found.append((size, piece))
            first += size
        size //= 2
    return found
