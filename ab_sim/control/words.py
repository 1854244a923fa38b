"""Texts on the state of the adaptive start-up."""

from ab_sim.control.estimates import Estimates, State
from ab_sim.control.observer import Observer
from ab_sim.control.settings import StartUpSettings


def words_of(
    state: State, reason: str, settings: StartUpSettings, estimates: Estimates, seen: Observer
) -> str:
    """Return the present action and its reason."""
    deviation = estimates.critical_speed_deviation
    critical = f"critical speed {estimates.critical_speed:.1f} +- {deviation:.2g} rad/s"
    net = f"net unbalance {1e6 * abs(estimates.net_unbalance):.3g} um"
    if seen.scale > 0.0:
        net += f", {seen.fast / seen.scale:.0%} of the largest"
    circulating = ", balls circulate" if seen.circulating else ""
    is_known = seen.known == 1.0
    where = "the critical speed is not known yet"
    texts = {
        State.WAITING: "for the first samples",
        State.RUN_UP: f"towards {settings.final_speed:g} rad/s; {critical if is_known else where}",
        State.DWELL: f"number {estimates.dwells}, a little above the critical speed, where the "
        f"whirl drives the balls; {critical}, {net}{circulating}",
        State.TO_FINAL: f"dwell {estimates.dwells} is over; {net}{circulating}",
        State.JUDGING: f"at {settings.final_speed:g} rad/s; "
        f"{net if is_known else where}{circulating}",
        State.RETRY: f"number {estimates.retries}: {net}, and it does not fall{circulating}; back "
        f"to just above the critical speed",
        State.DONE: f"{net}; after {_count(estimates.dwells, 'dwell', 'dwells')}, {critical}",
        State.GAVE_UP: f"{net if is_known else 'the sensor tells too little'}{circulating}; "
        f"stays at {settings.final_speed:g} rad/s after "
        f"{_count(estimates.retries, 'retry', 'retries')}",
        State.ABORTING: f"{reason}; runs down",
        State.ABORTED: f"{reason}; stands still",
    }
    return f"{state.text}: {texts[state]}"


def _count(number: int, one: str, several: str) -> str:
    return f"{number} {one if number == 1 else several}"
