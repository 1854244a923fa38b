"""Choice of the profile controller of a scene."""

from collections.abc import Iterable

from ab_sim.drive.adaptive import AdaptiveRun
from ab_sim.drive.faults.fault import Fault
from ab_sim.drive.leader import Leader
from ab_sim.drive.observation import Snapshot
from ab_sim.drive.segments_run import SegmentsRun
from ab_sim.scene.adaptive import AdaptiveProfile
from ab_sim.scene.model import Scene


def leader_of(scene: Scene, faults: Iterable[Fault] = ()) -> Leader | None:
    """Return the controller of a drive from its start on.

    None if its profile is known in advance.
    """
    if not scene.is_led:
        return None
    adaptive = isinstance(scene.profile, AdaptiveProfile)
    return AdaptiveRun(scene, faults) if adaptive else SegmentsRun(scene, faults)


def restored_leader(scene: Scene, faults: Iterable[Fault], snapshot: Snapshot) -> Leader | None:
    """Return the controller of a drive from a snapshot on; None if there is none.

    Raises:
        ValueError: the snapshot belongs to a drive with another profile.
    """
    if snapshot.leader is None:
        return None
    leader = leader_of(scene, faults)
    if leader is None:
        raise ValueError("the snapshot is of a drive whose profile decides while it runs")
    leader.restore(snapshot.leader)
    return leader
