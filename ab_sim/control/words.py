"""State of the adaptive start-up in plain words."""

from ab_sim.control.belief import Belief, State
from ab_sim.control.observer import Observer
from ab_sim.control.settings import StartUpSettings


def words_of(
    state: State, reason: str, settings: StartUpSettings, belief: Belief, seen: Observer
) -> str:
    """Return the present action and its reason."""
    critical = (
        f"critical speed {belief.critical_speed:.1f} +- {belief.critical_speed_deviation:.2g} rad/s"
    )
    net = f"net unbalance {1e6 * abs(belief.net_unbalance):.3g} um"
    if seen.scale > 0.0:
        net += f", {seen.fast / seen.scale:.0%} of the largest"
    circulating = ", balls circulate" if seen.circulating else ""
    known = seen.known == 1.0
    where = "the critical speed is not known yet"
    texts = {
        State.WAITING: "for the first samples",
        State.RUN_UP: f"towards {settings.final_speed:g} rad/s; {critical if known else where}",
        State.DWELL: f"number {belief.dwells}, a little above the critical speed, where the whirl "
        f"drives the balls; {critical}, {net}{circulating}",
        State.TO_FINAL: f"dwell {belief.dwells} is over; {net}{circulating}",
        State.JUDGING: f"at {settings.final_speed:g} rad/s; {net if known else where}{circulating}",
        State.RETRY: f"number {belief.retries}: {net}, and it does not fall{circulating}; back to "
        f"just above the critical speed",
        State.DONE: f"{net}; after {_count(belief.dwells, 'dwell', 'dwells')}, {critical}",
        State.GAVE_UP: f"{net if known else 'the sensor tells too little'}{circulating}; stays at "
        f"{settings.final_speed:g} rad/s after {_count(belief.retries, 'retry', 'retries')}",
        State.ABORTING: f"{reason}; runs down",
        State.ABORTED: f"{reason}; stands still",
    }
    return f"{state.text}: {texts[state]}"


def _count(number: int, one: str, several: str) -> str:
    return f"{number} {one if number == 1 else several}"
