"""The services that control `drive_sim`, with the meaning of ROS's simulation_interfaces."""

import functools
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from ab_msgs_py import services
from ab_msgs_py.services import Answer, Stepped, serve_switch, serve_trigger
from ab_sim.drive.disc import with_disc
from ab_sim.drive.snapshot_file import read_snapshot, write_snapshot
from ab_sim.errors import AbSimError
from ab_sim.nodes.drive_settings import TimeMode
from ab_sim.nodes.prepared import scene_of

if TYPE_CHECKING:
    from ab_sim.nodes.drive_sim import DriveSim

PATIENCE = 1.0
"""s for which a request waits for the commands that it is to follow."""


def _answered(act: Callable[["DriveControl"], Answer]) -> Callable[["DriveControl"], Answer]:
    """What ab_sim refuses is an answer, and ends no node."""

    @functools.wraps(act)
    def answer(control: "DriveControl") -> Answer:
        try:
            return act(control)
        except AbSimError as error:
            return False, str(error)

    return answer


class DriveControl:
    """Serves them for a node.

    Args:
        node: what they act on.
    """

    def __init__(self, node: "DriveSim") -> None:
        self._node = node
        self._heard = 0
        self.urgent = serve_trigger(node, services.EMERGENCY_STOP, self.emergency_stop)
        """The loop answers it itself: whatever else is being answered may take long."""
        serve_switch(node, services.PAUSE, self.pause)
        for name, act in (
            (services.STEP, self.step),
            (services.RESET, self.reset),
            (services.RESET_TIME, self.reset_time),
            (services.RESET_STATE, self.reset_state),
            (services.LOAD_SCENE, self.load_scene),
            (services.LOAD_DISC, self.load_disc),
            (services.SAVE_SNAPSHOT, self.save_snapshot),
            (services.RESTORE_SNAPSHOT, self.restore_snapshot),
            (services.RESET_EMERGENCY_STOP, self.reset_emergency_stop),
        ):
            serve_trigger(node, name, act)

    def pause(self, pause: bool) -> Answer:
        """Pause, or resume; simulated time stands still meanwhile."""
        node = self._node
        with node.turn:
            if not pause and node.mode is TimeMode.LOCK_STEP:
                return False, "time_mode is lock_step: time goes on by ~/step"
            if pause == node.paused:
                return True, "paused already" if pause else "running already"
            if not pause and node.trouble:
                return False, f"{node.trouble}; reset first"
            node.settle()
            node.paused = pause
            node.restart_clock()
            return True, "paused" if pause else "running"

    def step(self) -> Answer:
        """As many wake-ups as the parameter says, while time stands still."""
        node, values = self._node, self._node.settings.values
        if refusal := self._wait_for(values["await_commands"]):
            return False, refusal
        wakes = 0
        while wakes < values["steps"] and not node.stopping.is_set():
            with node.turn:
                if not node.standing:
                    return False, "not paused: pause first"
                if node.trouble:
                    return False, f"{node.trouble}; reset first"
                node.take_commands()
                node.advance(node.now.per_wake)
                if node.trouble:
                    return False, node.trouble
            wakes += 1
        with node.turn:
            node.flush()
            self._heard = node.path.heard
            return True, Stepped(node.now.time_ns, wakes, node.path.heard).text

    def reset(self) -> Answer:
        """Back to t = 0 and the scene's start; a command under way is forgotten."""
        return self._leap(self._node.led.reset, "reset to t = 0")

    def reset_time(self) -> Answer:
        """Back to t = 0 in the present state."""
        return self._leap(self._node.led.reset_time, "time reset to t = 0")

    def reset_state(self) -> Answer:
        """Back to the scene's start, and time goes on; a command under way is forgotten."""
        return self._leap(self._node.led.reset_state, "state reset")

    @_answered
    def load_scene(self) -> Answer:
        """The scene of the parameters, from t = 0."""
        node, values = self._node, self._node.settings.values
        prepared = node.prepare(scene_of(values["scene"], values["changes"], node.rates))
        with node.turn:
            self._leave()
            node.path.lead(prepared.drive.servo, prepared.drive.step)
            node.trouble = ""
            node.begin(prepared)
            self._arrive()
            return True, f"{prepared.scene.name}, t = 0"

    @_answered
    def load_disc(self) -> Answer:
        """The disc of the parameters, in the present state."""
        node, values = self._node, self._node.settings.values
        eccentricity, angle = values["disc_eccentricity"], values["disc_angle"]
        scene, moved = with_disc(node.now.scene, eccentricity, angle)
        prepared = node.prepare(scene)
        with node.turn:
            self._leave()
            if node.trouble:
                return False, f"{node.trouble}; reset first"
            kept = moved(node.now.drive.snapshot())
            node.begin(prepared)
            node.led.leap(kept)
            node.pending = [node.now.drive.present()]
            self._arrive()
            return True, f"eccentricity {eccentricity:g} m, {angle:g} rad further"

    @_answered
    def save_snapshot(self) -> Answer:
        """The present, to a file."""
        node = self._node
        path = Path(node.settings.values["snapshot"]).expanduser()
        with node.turn:
            node.settle()
            kept = node.now.drive.snapshot(), node.path.state()
            scene, time_ns = node.now.scene, node.now.time_ns
            if not node.standing:
                node.restart_clock()
        write_snapshot(path, scene, *kept)
        return True, f"{path}: t = {time_ns * 1e-9:.9g} s"

    @_answered
    def restore_snapshot(self) -> Answer:
        """Back to what a file holds."""
        node = self._node
        path = Path(node.settings.values["snapshot"]).expanduser()
        kept, commands = read_snapshot(path, node.now.scene)

        def leap() -> None:
            node.led.leap(kept)
            node.path.restore(commands)

        return self._leap(leap, f"restored {path}")

    def emergency_stop(self) -> Answer:
        """To standstill as fast as the spindle can, whatever is commanded."""
        node = self._node
        with node.turn:
            if node.path.stopped:
                return True, "stopped already"
            node.take_commands()
            node.path.emergency_stop()
            node.report()
        node.get_logger().warning("emergency stop")
        return True, "stopping; commands are ignored until ~/reset_emergency_stop"

    def reset_emergency_stop(self) -> Answer:
        """Follow commands again."""
        node = self._node
        with node.turn:
            if not node.path.stopped:
                return False, "there is no emergency stop"
            node.take_commands()
            node.path.release()
            node.report()
        node.get_logger().info("emergency stop is over")
        return True, "the next command is followed"

    def _wait_for(self, commands: int) -> str:
        """Until so many have come since the last request; why not, if they do not."""
        node, end = self._node, time.monotonic() + PATIENCE
        while True:
            with node.turn:
                if not node.standing:
                    return ""
                node.take_commands()
                came = node.path.heard - self._heard
            if came >= commands:
                return ""
            if time.monotonic() > end or node.stopping.is_set():
                return f"{came} of {commands} commands came within {PATIENCE:g} s; no step taken"
            time.sleep(2e-4)

    def _leap(self, leap: Callable[[], None], said: str) -> Answer:
        node = self._node
        with node.turn:
            self._leave()
            leap()
            node.trouble = ""
            node.pending = [node.now.drive.present()]
            self._arrive()
        node.get_logger().info(said)
        return True, f"t = {node.now.time_ns * 1e-9:.9g}"

    def _leave(self) -> None:
        """Last words of what has run."""
        node = self._node
        node.settle()
        if node.now.drive.steps:
            node.flush()
        node.report()

    def _arrive(self) -> None:
        """First words of what runs now."""
        self._node.publish()
        self._node.restart_clock()
