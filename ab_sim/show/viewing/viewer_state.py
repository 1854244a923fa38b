"""State of the web viewer, as Rerun 0.41's page reports it: newest time of each recording."""

from ab_sim.base.protobuf import fields_of

TIMELINE = b"sim_time"


def newest_times(state: bytes) -> dict[str, float]:
    """Return the newest time [s] that the viewer has of each recording, by the recording's id.

    Args:
        state: ``GetStateResponse`` of Rerun's viewer control, in protobuf's wire format.

    Raises:
        TypeError, ValueError: the state has another form.
    """
    times = {}
    for recording in map(fields_of, fields_of(state).get(3, [])):
        name = b"".join(recording.get(1, [])).decode(errors="replace")
        for timeline in recording.get(2, []):
            if TIMELINE in timeline:
                spans = map(fields_of, fields_of(timeline).get(3, []))
                ends = [end for span in spans for end in span.get(2, [])]
                times[name.rpartition(":")[2]] = 1e-9 * max(ends, default=0)
    return times
