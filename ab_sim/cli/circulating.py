"""Texts of commands on circulating balls."""

from collections.abc import Iterator, Sequence

from ab_sim.analysis.circulating import Reach
from ab_sim.analysis.circulating.reach import END, SWING
from ab_sim.analysis.coexisting import Coexisting, CoexistingCirculation


def circulation_lines(
    found: CoexistingCirculation, balls: int, stable: Sequence[str]
) -> Iterator[str]:
    """Yield lines on circulating balls.

    Args:
        found: result of the search at a speed.
        balls: n.
        stable: labels of the resting states that are stable at the speed.
    """
    if found.not_looked_for is not None:
        if balls:
            yield f"balls that circulate are not looked for: {found.not_looked_for}"
        return
    if found.states:
        beside = "; ".join(f"{label}: stable" for label in stable)
        said = f"coexisting with {beside}" if stable else "where no resting state is stable"
        yield f"balls can also circulate, {said}:"
        yield from (_line(each, balls) for each in found.states)
    else:
        yield f"no bunch of balls circulates at {found.speed:g} rad/s"
    if len(found.numbers) < balls:
        yield f"  looked for: bunches of {', '.join(map(str, found.numbers))} balls"
    for each in found.elsewhere:
        denied = ""
        if each.low <= abs(found.speed) <= each.high:
            denied = f"; at {found.speed:g} rad/s the full equations do not bear that out"
        over = _range(each, "rad/s", "at spindle speeds")
        yield f"  by the closed form, all {balls} can circulate {over}{denied}"


def _line(found: Coexisting, balls: int) -> str:
    reach = []
    if found.over_speed is not None:
        reach.append(_range(found.over_speed, "rad/s", "at spindle speeds"))
    if found.over_drag is not None:
        reach.append(_range(found.over_drag, "N s/m", "with drags"))
    own = f"  {found.bunch.count} of {balls} at {found.speed:.4g} rad/s (stable)"
    return "; ".join([own, *reach])


def _range(found: Reach, unit: str, what: str) -> str:
    """Return a range in words; ends of the known or searched range are marked as such."""
    low = "" if found.low_end == END else f" from {found.low:.4g}"
    high = "" if found.high_end == END else f" to {found.high:.4g}"
    unknown = [
        side for side, end in (("below", found.low_end), ("above", found.high_end)) if end == SWING
    ]
    said = f"{what}{low}{high} {unit}" if low or high else f"{what} of any size"
    return f"{said} (not known {' and '.join(unknown)})" if unknown else said
