"""The services that control `drive_sim`, with the meaning of ROS's simulation_interfaces."""

import functools
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from ab_msgs_py import services
from ab_msgs_py.services import Answer, Stepped, serve_switch, serve_trigger
from ab_sim.drive.disc import with_disc
from ab_sim.drive.faults.fault import Fault, faults_of
from ab_sim.drive.snapshot_file import read_snapshot, write_snapshot
from ab_sim.errors import AbSimError, CommandError, InputError
from ab_sim.nodes.command_path import CommandPath
from ab_sim.nodes.drive_settings import TimeMode
from ab_sim.nodes.parameters import path_of
from ab_sim.nodes.prepared import Prepared
from ab_sim.scene import Scene

if TYPE_CHECKING:
    from ab_sim.nodes.bench import Bench
    from ab_sim.nodes.drive_sim import DriveSim

PATIENCE = 1.0
"""s for which a request waits for the commands that it is to follow."""


def _answered(act: Callable[..., Answer]) -> Callable[..., Answer]:
    """What ab_sim refuses is an answer, and ends no node."""

    @functools.wraps(act)
    def answer(*given: bool) -> Answer:
        try:
            return act(*given)
        except AbSimError as error:
            return False, str(error)

    return answer


class DriveControl:
    """Serves them for a node; all are refused while it is not active.

    Args:
        node: what they act on.
    """

    def __init__(self, node: "DriveSim") -> None:
        self._node = node
        # The loop answers it itself: whatever else is being answered may take long.
        stop = serve_trigger(node, services.EMERGENCY_STOP, _answered(self.emergency_stop))
        node.by_loop.append(stop)
        serve_switch(node, services.PAUSE, _answered(self.pause))
        for name, act in (
            (services.STEP, self.step),
            (services.RESET, self.reset),
            (services.RESET_TIME, self.reset_time),
            (services.RESET_STATE, self.reset_state),
            (services.LOAD_SCENE, self.load_scene),
            (services.LOAD_DISC, self.load_disc),
            (services.INJECT_FAULTS, self.inject_faults),
            (services.CLEAR_FAULTS, self.clear_faults),
            (services.SAVE_SNAPSHOT, self.save_snapshot),
            (services.RESTORE_SNAPSHOT, self.restore_snapshot),
            (services.RESET_EMERGENCY_STOP, self.reset_emergency_stop),
        ):
            serve_trigger(node, name, _answered(act))

    def pause(self, pause: bool) -> Answer:
        """Pause, or resume; simulated time stands still meanwhile."""
        with self._node.active() as bench:
            if not pause and bench.mode is TimeMode.LOCK_STEP:
                return False, "time_mode is lock_step: time goes on by ~/step"
            if pause == bench.paused:
                return True, "paused already" if pause else "running already"
            if not pause and bench.trouble:
                return False, f"{bench.trouble}; reset first"
            bench.settle()
            bench.paused = pause
            bench.restart_clock()
            return True, "paused" if pause else "running"

    def step(self) -> Answer:
        """As many wake-ups as the parameter says, while time stands still."""
        node, values = self._node, self._node.settings.values
        if refusal := self._wait_for(values["await_commands"]):
            return False, refusal
        wakes = 0
        while wakes < values["steps"] and not node.stopping.is_set():
            with node.active() as bench:
                if not bench.standing:
                    return False, "not paused: pause first"
                if bench.trouble:
                    return False, f"{bench.trouble}; reset first"
                bench.take_commands()
                bench.advance(bench.now.per_wake)
                if bench.trouble:
                    return False, bench.trouble
            wakes += 1
        with node.active() as bench:
            bench.flush()
            commands, bench.stepped_for = bench.new_commands, bench.path.heard
            return True, Stepped(bench.now.time_ns, wakes, commands).text

    def reset(self) -> Answer:
        """Back to t = 0 and the scene's start; a command under way is forgotten."""
        return self._leap(lambda bench: bench.led.reset(), "reset to t = 0")

    def reset_time(self) -> Answer:
        """Back to t = 0 in the present state."""
        return self._leap(lambda bench: bench.led.reset_time(), "time reset to t = 0")

    def reset_state(self) -> Answer:
        """Back to the scene's start, and time goes on; a command under way is forgotten."""
        return self._leap(lambda bench: bench.led.reset_state(), "state reset")

    def load_scene(self) -> Answer:
        """The scene of the parameters, from t = 0."""
        node, values = self._node, self._node.settings.values
        with node.active() as bench:
            asked = bench
        prepared = self._prepare(node.scene_of(values))
        with node.active(asked) as bench:
            bench.settle()
            _last_words(bench)
            bench.path.lead(prepared.drive.servo, prepared.drive.step)
            bench.trouble = ""
            bench.begin(prepared)
            bench.publish()
            bench.restart_clock()
            return True, f"{prepared.scene.name}, t = 0"

    def load_disc(self) -> Answer:
        """The disc of the parameters, in the present state."""
        node, values = self._node, self._node.settings.values
        eccentricity, angle = values["disc_eccentricity"], values["disc_angle"]
        with node.active() as bench:
            asked, before = _sound(bench), bench.now
            scene, moved = with_disc(before.scene, eccentricity, angle)
        share = node.settings.values["error_checks"]
        prepared = node.unless_ended(lambda: before.altered(scene, (), share))
        with node.active(asked) as bench:
            _leave(bench)
            if bench.trouble:
                return False, f"{bench.trouble}; reset first"
            kept = moved(bench.now.drive.snapshot())
            bench.begin(prepared)
            bench.led.leap(kept)
            bench.pending = [bench.now.drive.present()]
            _arrive(bench)
            return True, f"eccentricity {eccentricity:g} m, {angle:g} rad further"

    def inject_faults(self) -> Answer:
        """Those of the parameter, instead of those in force; time goes on."""
        if not (faults := faults_of(self._node.settings.values["faults"])):
            return False, "the parameter faults names none: set it first, or ~/clear_faults"
        return self._break(faults)

    def clear_faults(self) -> Answer:
        """None any more; time goes on."""
        return self._break(())

    def save_snapshot(self) -> Answer:
        """The present, to a file."""
        path = path_of(self._node.settings.values["snapshot"])
        with self._node.active() as bench:
            _sound(bench).catch_up()
            kept = bench.now.drive.snapshot(), bench.path.state()
            scene, time_ns = bench.now.scene, bench.now.time_ns
        write_snapshot(path, scene, *kept, CommandPath.__module__)
        return True, f"{path}: t = {time_ns * 1e-9:.9g} s"

    def restore_snapshot(self) -> Answer:
        """Back to what a file holds."""
        path = path_of(self._node.settings.values["snapshot"])
        with self._node.active() as bench:
            asked, scene = _sound(bench), bench.now.scene
        kept, commands = read_snapshot(path, scene, CommandPath.__module__)

        def leap(bench: "Bench") -> None:
            try:
                bench.now.drive.check(kept)
            except ValueError as error:
                raise InputError(f"snapshot {path}: {error}") from error
            bench.path.restore(commands)  # it may refuse, too
            bench.led.leap(kept)

        return self._leap(leap, f"restored {path}", asked)

    def emergency_stop(self) -> Answer:
        """To standstill as fast as the spindle can, whatever is commanded."""
        with self._node.active() as bench:
            if bench.path.stopped:
                return True, "stopped already"
            bench.take_commands()
            bench.path.emergency_stop()
            bench.report()
        self._node.get_logger().warning("emergency stop")
        return True, "stopping; commands are ignored until ~/reset_emergency_stop"

    def reset_emergency_stop(self) -> Answer:
        """Follow commands again."""
        with self._node.active() as bench:
            if not bench.path.stopped:
                return False, "there is no emergency stop"
            bench.take_commands()
            bench.path.release()
            bench.report()
        self._node.get_logger().info("emergency stop is over")
        return True, "the next command is followed"

    def _prepare(self, scene: Scene) -> Prepared:
        node = self._node
        values, say = node.settings.values, node.get_logger().info
        return node.unless_ended(lambda: node.prepare(scene, values, say))

    def _break(self, faults: tuple[Fault, ...]) -> Answer:
        with self._node.active() as bench:
            asked, before = bench, bench.now
            if faults == before.drive.faults:
                return True, f"faults in force already: {bench.marks.words}"
        share = self._node.settings.values["error_checks"]
        prepared = self._node.unless_ended(lambda: before.altered(before.scene, faults, share))
        with self._node.active(asked) as bench:
            _leave(bench)
            if bench.trouble:
                return False, f"{bench.trouble}; reset first"
            bench.go_on_with(prepared)
            _arrive(bench)
            bench.report()
            return True, f"faults in force: {bench.marks.words}"

    def _wait_for(self, commands: int) -> str:
        """Until so many have come since the last request; why not, if they do not."""
        node, end = self._node, time.monotonic() + PATIENCE
        while True:
            with node.active() as bench:
                if not bench.standing:
                    return ""
                bench.take_commands()
                came = bench.new_commands
            if came >= commands:
                return ""
            if time.monotonic() > end or node.stopping.is_set():
                return f"{came} of {commands} commands came within {PATIENCE:g} s; no step taken"
            time.sleep(2e-4)

    def _leap(
        self, leap: Callable[["Bench"], None], said: str, asked: "Bench | None" = None
    ) -> Answer:
        with self._node.active(asked) as bench:
            _leave(bench)
            leap(bench)
            bench.trouble = ""
            bench.pending = [bench.now.drive.present()]
            _arrive(bench)
            reached = bench.now.time_ns
        self._node.get_logger().info(said)
        return True, f"t = {reached * 1e-9:.9g}"


def _sound(bench: "Bench") -> "Bench":
    """The same.

    Raises:
        CommandError: its drive is broken, and what is asked for is made for a sound one.
    """
    if bench.now.drive.faults:
        raise CommandError(f"faults are in force ({bench.marks.words}): ~/clear_faults first")
    return bench


def _leave(bench: "Bench") -> None:
    """What has run does so until now, and says so."""
    bench.catch_up()
    _last_words(bench)


def _last_words(bench: "Bench") -> None:
    if bench.now.drive.steps:
        bench.flush()
    bench.report()


def _arrive(bench: "Bench") -> None:
    """First words of what runs now."""
    bench.publish()
    bench.go_on(time.monotonic())
