"""Which leader a scene's profile has."""

from collections.abc import Iterable

from ab_sim.drive.adaptive import AdaptiveRun
from ab_sim.drive.faults.fault import Fault
from ab_sim.drive.leader import Leader
from ab_sim.drive.observation import Snapshot
from ab_sim.drive.segments_run import SegmentsRun
from ab_sim.scene.adaptive import AdaptiveProfile
from ab_sim.scene.model import Scene


def leader_of(scene: Scene, faults: Iterable[Fault] = ()) -> Leader | None:
    """What commands a drive of a scene from its start on; None: its profile is known beforehand."""
    if not scene.is_led:
        return None
    adaptive = isinstance(scene.profile, AdaptiveProfile)
    return AdaptiveRun(scene, faults) if adaptive else SegmentsRun(scene, faults)


def restored_leader(scene: Scene, faults: Iterable[Fault], snapshot: Snapshot) -> Leader | None:
    """What commands a drive of a scene from a snapshot on; None: nothing does.

    Raises:
        ValueError: the snapshot is of a drive with another profile.
    """
    if snapshot.leader is None:
        return None
    leader = leader_of(scene, faults)
    if leader is None:
        raise ValueError("the snapshot is of a drive whose profile decides while it runs")
    leader.restore(snapshot.leader)
    return leader
