"""Choice of the profile controller of a scene."""

from collections.abc import Iterable

from ab_sim.drive.adaptive_controller import AdaptiveController
from ab_sim.drive.controller import RunController
from ab_sim.drive.faults.fault import Fault
from ab_sim.drive.observation import Snapshot
from ab_sim.drive.segments_controller import SegmentsController
from ab_sim.scene.model import Scene
from ab_sim.scene.profiles import AdaptiveProfile


def controller_of(scene: Scene, faults: Iterable[Fault] = ()) -> RunController | None:
    """Return the controller of a drive at its start; None if its profile is known in advance."""
    if not scene.is_controlled:
        return None
    adaptive = isinstance(scene.profile, AdaptiveProfile)
    return AdaptiveController(scene, faults) if adaptive else SegmentsController(scene, faults)


def restored_controller(
    scene: Scene, faults: Iterable[Fault], snapshot: Snapshot
) -> RunController | None:
    """Return the controller of a drive in the state of a snapshot; None if it has none.

    Raises:
        ValueError: the snapshot belongs to a drive with another profile.
    """
    if snapshot.controller is None:
        return None
    controller = controller_of(scene, faults)
    if controller is None:
        raise ValueError("the snapshot is of a drive with a profile controller, this one has none")
    controller.restore(snapshot.controller)
    return controller
