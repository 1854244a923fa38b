"""Services that control `drive_sim`, with the semantics of ROS's simulation_interfaces."""

import time
from collections.abc import Callable

from ab_msgs_py import services
from ab_msgs_py.services import Answer, Stepped
from ab_sim.base.errors import CommandError, InputError
from ab_sim.drive.disc import with_disc
from ab_sim.drive.faults.fault import Fault, faults_of
from ab_sim.drive.snapshot_file import read_snapshot, write_snapshot
from ab_sim.nodes.command_path import CommandPath
from ab_sim.nodes.drive_node import DriveNode
from ab_sim.nodes.drive_settings import TimeMode
from ab_sim.nodes.parameters import path_of
from ab_sim.nodes.prepared_drive import PreparedDrive
from ab_sim.nodes.session import Session
from ab_sim.scene import Scene

PATIENCE = 1.0
"""Longest time for which ~/step waits for commands [s]."""
_PROMPTLY = 0.2
"""Longest time for which ~/emergency_stop waits for the end of steps in progress [s]."""


class DriveControl:
    """Services of a drive's node; all are refused while it is not active.

    Parameters
    ----------
    node
        Node that offers the services.
    """

    def __init__(self, node: DriveNode) -> None:
        self._node = node
        # Served by the main loop, because the executor may be busy with another service.
        stop = node.offer(services.EMERGENCY_STOP, self.emergency_stop)
        node.by_loop.append(stop)
        node.offer_switch(services.PAUSE, self.pause)
        for name, work in (
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
            node.offer(name, work)

    def pause(self, pause: bool) -> Answer:
        """Pause or resume simulated time."""
        with self._node.active() as session:
            if not pause and session.mode is TimeMode.LOCK_STEP:
                return False, "time_mode is lock_step: time advances by ~/step only"
            if pause == session.paused:
                return True, "paused already" if pause else "running already"
            if not pause and session.trouble:
                return False, f"{session.trouble}; reset first"
            session.step_before_pause()
            session.paused = pause
            session.restart_clock()
            return True, "paused" if pause else "running"

    def stop(self) -> Answer:
        """Pause, and reset to t = 0 and the scene's start."""

        def leap(session: Session) -> None:
            session.commanded.reset()
            session.paused = session.stopped = True

        return self.leap(leap, "stopped: paused, reset to t = 0")

    def step(self, count: int | None = None) -> Answer:
        """Simulate a number of wake-ups while time is paused; default: the parameter `steps`."""
        node, values = self._node, self._node.settings.values
        if refusal := self._wait_for(values["await_commands"]):
            return False, refusal
        count = values["steps"] if count is None else count
        wakes = commands = stepped_for = 0
        while wakes < count and not node.stopping.is_set():
            with node.active() as session:
                if not session.standing:
                    return False, "not paused: pause first"
                if session.trouble:
                    return False, f"{session.trouble}; reset first"
                session.take_commands()
                commands, stepped_for = session.new_commands, session.path.received
                session.advance(session.now.per_wake)
                if session.trouble:
                    return False, session.trouble
            wakes += 1
        with node.active() as session:
            session.flush()
            # Commands that arrive from now on count for the next request, because they may be the
            # reaction to the last wake-up.
            session.stepped_for = stepped_for
            return True, Stepped(session.now.time_ns, wakes, commands).text

    def reset(self) -> Answer:
        """Return to t = 0 and the scene's start; pending commands are dropped."""
        return self.leap(lambda session: session.commanded.reset(), "reset to t = 0")

    def reset_time(self) -> Answer:
        """Return to t = 0 in the present state."""
        return self.leap(lambda session: session.commanded.reset_time(), "time reset to t = 0")

    def reset_state(self) -> Answer:
        """Return to the scene's start and keep the time; pending commands are dropped."""
        return self.leap(lambda session: session.commanded.reset_state(), "state reset")

    def load_scene(self, stopped: bool = False) -> Answer:
        """Load the scene that the parameters name, at t = 0, and pause there if ``stopped``."""
        node, values = self._node, self._node.settings.values
        with node.active() as session:
            expected = session
        prepared = self._prepare(node.scene_of(values))
        with node.active(expected) as session:
            session.step_before_pause()
            _publish_last(session)
            session.path.lead(prepared.drive.servo, prepared.drive.step)
            session.trouble = ""
            if stopped:
                session.paused = session.stopped = True
            session.begin(prepared)
            session.publish()
            session.restart_clock()
            return True, f"{prepared.scene.name}, t = 0"

    def load_disc(self) -> Answer:
        """Replace the disc by that of the parameters `disc_...`; the present motion continues."""
        node, values = self._node, self._node.settings.values
        eccentricity, angle = values["disc_eccentricity"], values["disc_angle"]
        with node.active() as session:
            expected, before = sound(session), session.now
            if eccentricity < 0.0:
                return False, "the parameter disc_eccentricity was never set: set it first [m]"
            scene, moved = with_disc(before.scene, eccentricity, angle)
        share = node.settings.values["error_checks"]
        prepared = node.run_unless_shut_down(lambda: before.altered(scene, (), share))
        with node.active(expected) as session:
            _leave(session)
            if session.trouble:
                return False, f"{session.trouble}; reset first"
            kept = moved(session.now.drive.snapshot())
            session.begin(prepared)
            session.commanded.restore(kept)
            session.pending = [session.now.drive.present()]
            _arrive(session)
            return True, f"eccentricity {eccentricity:g} m, {angle:g} rad further"

    def inject_faults(self) -> Answer:
        """Replace the drive's faults by those of the parameter `faults`; time continues."""
        if not (faults := faults_of(self._node.settings.values["faults"])):
            return False, "the parameter faults is empty: set it first, or call ~/clear_faults"
        return self._break(faults)

    def clear_faults(self) -> Answer:
        """Remove the drive's faults; time continues."""
        return self._break(())

    def save_snapshot(self) -> Answer:
        """Save the present state to the file of the parameter `snapshot`."""
        path = path_of(self._node.settings.values["snapshot"])
        with self._node.active() as session:
            sound(session).catch_up()
            kept = session.now.drive.snapshot(), session.path.state()
            scene, time_ns = session.now.scene, session.now.time_ns
        write_snapshot(path, scene, *kept, CommandPath.__module__)
        return True, f"{path}: t = {time_ns * 1e-9:.9g} s"

    def restore_snapshot(self) -> Answer:
        """Restore the state in the file of the parameter `snapshot`."""
        path = path_of(self._node.settings.values["snapshot"])
        with self._node.active() as session:
            expected, scene = sound(session), session.now.scene
        kept, commands = read_snapshot(path, scene, CommandPath.__module__)

        def leap(session: Session) -> None:
            try:
                session.now.drive.check(kept)
            except ValueError as error:
                raise InputError(f"snapshot {path}: {error}") from error
            session.path.restore(commands)  # raises for an invalid state, before anything changes
            session.commanded.restore(kept)

        return self.leap(leap, f"restored {path}", expected)

    def emergency_stop(self) -> Answer:
        """Decelerate to standstill as fast as the spindle can, and ignore commands."""
        try:
            with self._node.active(patience=_PROMPTLY) as session:
                if session.path.stopped:
                    return True, "stopped already"
                session.take_commands()
                session.path.emergency_stop()
                session.report()
        except TimeoutError:
            # Another thread takes a long step under the lock: it begins the stop after this step.
            self._node.stop_when_possible()
            self._node.get_logger().warning("emergency stop, after the step in progress")
            return True, (
                "stopping after the step in progress, which takes long; commands are ignored until "
                "~/reset_emergency_stop"
            )
        self._node.get_logger().warning("emergency stop")
        return True, "stopping; commands are ignored until ~/reset_emergency_stop"

    def reset_emergency_stop(self) -> Answer:
        """End an emergency stop: follow commands again."""
        with self._node.active() as session:
            if not session.path.stopped:
                return False, "there is no emergency stop"
            session.take_commands()
            session.path.release()
            session.report()
        self._node.get_logger().info("emergency stop is over")
        return True, "the next command is followed"

    def _prepare(self, scene: Scene) -> PreparedDrive:
        """Prepare the drive of a scene in another thread, so that the node can still exit."""
        node = self._node
        values, say = node.settings.values, node.get_logger().info
        return node.run_unless_shut_down(lambda: node.prepare(scene, values, say))

    def _break(self, faults: tuple[Fault, ...]) -> Answer:
        """Replace all faults of the drive.

        Another drive with the faults is prepared without the node's lock, because compiling takes
        long; meanwhile the present drive continues. It is replaced under the lock, from its state.
        """
        with self._node.active() as session:
            expected, before = session, session.now
            if faults == before.drive.faults:
                return True, f"faults in force already: {session.fault_publisher.words}"
        share = self._node.settings.values["error_checks"]
        prepared = self._node.run_unless_shut_down(
            lambda: before.altered(before.scene, faults, share)
        )
        with self._node.active(expected) as session:
            _leave(session)
            if session.trouble:
                return False, f"{session.trouble}; reset first"
            session.replace_drive(prepared)
            _arrive(session)
            session.report()
            return True, f"faults in force: {session.fault_publisher.words}"

    def _wait_for(self, commands: int) -> str:
        """Wait until a number of commands have arrived since the last request of ~/step.

        Before its last point, a trajectory counts as enough commands.

        Returns
        -------
        str
            Empty text, or a refusal after ``PATIENCE``.
        """
        node, end = self._node, time.monotonic() + PATIENCE
        while True:
            with node.active() as session:
                if not session.standing:
                    return ""
                session.take_commands()
                came = session.new_commands
                led = session.path.follows(session.now.drive.steps)
            if led or came >= commands:
                return ""
            if time.monotonic() > end or node.stopping.is_set():
                return f"{came} of {commands} commands arrived in {PATIENCE:g} s; no step was taken"
            time.sleep(2e-4)

    def leap(
        self, leap: Callable[[Session], None], text: str, expected: Session | None = None
    ) -> Answer:
        """Change the state or time of a session, and continue the run from the new one.

        Parameters
        ----------
        leap
            Function that changes the session, called under the node's lock.
        text
            Message for the log.
        expected
            Expected session; None: any.
        """
        with self._node.active(expected) as session:
            _leave(session)
            leap(session)
            session.trouble = ""
            session.pending = [session.now.drive.present()]
            _arrive(session)
            reached = session.now.time_ns
        self._node.get_logger().info(text)
        return True, f"t = {reached * 1e-9:.9g}"


def sound(session: Session) -> Session:
    """Return the session if its drive has no faults.

    Raises
    ------
    CommandError
        The drive has faults, which prevent the request.
    """
    if session.now.drive.faults:
        raise CommandError(
            f"faults are in force ({session.fault_publisher.words}): ~/clear_faults first"
        )
    return session


def _leave(session: Session) -> None:
    """Take the due steps of a drive that will be replaced; publish last samples and diagnostics."""
    session.catch_up()
    _publish_last(session)


def _publish_last(session: Session) -> None:
    """Publish the samples since the last block, and diagnostics."""
    if session.now.drive.steps:
        session.flush()
    session.report()


def _arrive(session: Session) -> None:
    """Publish the first state of the new drive."""
    session.publish()
    session.restart_measurement(time.monotonic())
