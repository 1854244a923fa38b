"""Numbers in lanes written line by line: a line of memory for each lane, in LLVM's language."""

from collections.abc import Sequence

from ab_sim.tracing.llvm_text import Function, kind

WIDTH = 8
"""Lanes that are turned at once."""


def store_lines(into: Function, columns: Sequence[str], pointers: Sequence[str]) -> None:
    """Write numbers that are in lanes, each lane's in a line of its own.

    Groups of columns are written one after the other, as all lines at once would not fit into
    registers. Where several lanes have one pointer, the first of them stays.

    Args:
        into: the function.
        columns: names of values in lanes.
        pointers: LLVM's names of where the lines are, one for each lane.
    """
    lanes = len(pointers)
    width = min(WIDTH, lanes)
    for first in range(0, len(columns), width):
        group = list(columns[first : first + width])
        for lane in reversed(range(0, lanes, width)):
            part = range(lane, lane + width)
            square = [x if lanes == width else into.shuffled(x, lanes, part) for x in group]
            square += ["poison"] * (width - len(group))
            turned = zip(part, _transposed(into, square), strict=True)
            for k, line in reversed([*turned]):
                at = first
                for count, value in _cut(into, line, width, len(group)):
                    place = into.put(f"getelementptr double, ptr {pointers[k]}, i64 {at}")
                    into.lines.append(f"store {kind(count)} {value}, ptr {place}, align 8")
                    at += count


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
