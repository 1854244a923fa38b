"""Emit LLVM IR that writes numbers in lanes to memory with one row per lane (a transposition)."""

from collections.abc import Sequence

from ab_sim.tracing.llvm_text import Function, kind

WIDTH = 8
"""Largest number of lanes that are transposed together."""


def store_lines(into: Function, columns: Sequence[str], pointers: Sequence[str]) -> None:
    """Append stores of numbers in lanes, such that each lane's numbers are adjacent in memory.

    Groups of columns are transposed and stored in turn, as all of them together would not fit into
    registers. Lanes are stored from the last to the first, so that of several lanes with one
    pointer the first one's numbers remain.

    Args:
        into: function to which lines are appended.
        columns: names of values in lanes.
        pointers: LLVM's names of the pointers to the rows, one for each lane.
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
    """Return the transpose of a square matrix of vectors.

    Blocks next to the diagonal are exchanged, at half the size in each round, so that n vectors
    need n log2(n) shuffles (Eklundh 1972, IEEE Trans. Comput. C-21, 801-803).
    """
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
    """Return the first ``count`` numbers of a vector, in pieces whose sizes are powers of two.

    Each piece can be stored by one instruction.
    """
    if count == width:
        return [(width, value)]
    pieces, first, size = [], 0, width // 2
    while size:
        if count & size:
            which = range(first, first + size)
            piece = (
                into.put(f"extractelement {kind(width)} {value}, i32 {first}")
                if size == 1
                else into.shuffled(value, width, which)
            )
            pieces.append((size, piece))
            first += size
        size //= 2
    return pieces
