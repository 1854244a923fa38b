"""Lifecycle node that runs a drive in real time, from configure to cleanup."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Iterator
from typing import Any

from rclpy.subscription import Subscription

from ab_msgs_py import ENDED, Level
from ab_msgs_py.services import EMERGENCY_STOP, answer_waiting
from ab_sim.base.errors import AbSimError, CommandError, Interrupted
from ab_sim.base.files import REPORT, check_ending
from ab_sim.drive.faults.fault import faults_of
from ab_sim.nodes.base_node import GLANCE, ManagedNode, Say
from ab_sim.nodes.commands import unused_callback
from ab_sim.nodes.drive_health import PERIOD
from ab_sim.nodes.drive_settings import DRIVE_PARAMETERS, rates_of, tolerance_of
from ab_sim.nodes.outputs import Outputs
from ab_sim.nodes.parameters import Parameters, Values, path_of
from ab_sim.nodes.prepared_drive import PreparedDrive, scene_of
from ab_sim.nodes.realtime import FairLock, StallGuard
from ab_sim.nodes.session import INACTIVE, Session
from ab_sim.scene import Scene

_PROMPT = 0.003
"""Time between two checks for requests that the main loop serves [s]. A check costs as much as half
a step, and no client needs an answer sooner."""
_UNCONFIGURED = "unconfigured: no scene is loaded"


class DriveNode(ManagedNode):
    """Node with a session from configure to cleanup; time advances while the node is active."""

    def __init__(self) -> None:
        super().__init__("drive_sim", EMERGENCY_STOP)
        self.settings = Parameters(self, DRIVE_PARAMETERS)
        if self.get_parameter("use_sim_time").value:
            self.get_logger().warning(
                "use_sim_time = True: has no effect, because this node is the source of simulated "
                "time; set it for the other nodes"
            )
        values = self.settings.values
        self._rates = rates_of(values)
        self._turn = FairLock()
        self._outputs = Outputs(
            self, values["scene"], values["hardware_id"], values["publish_clock"]
        )
        self._session: Session | None = None
        self._state = Level.OK, _UNCONFIGURED
        self._reported = 0.0
        self.settings.accept_changes(self._check, self._apply)

    @property
    def subscriptions(self) -> Iterator[Subscription[Any]]:
        """Subscriptions that the executor serves: all but commands, which are read at wake-ups."""
        return (s for s in super().subscriptions if s.callback is not unused_callback)

    @property
    def session(self) -> Session | None:
        """Session of the loaded scene; None if no scene is loaded."""
        return self._session

    @property
    def is_configuring(self) -> bool:
        """True while a scene is being loaded for the transition configure."""
        return bool(self._state_machine.current_state[1] == "configuring")

    @contextlib.contextmanager
    def active(
        self, expected: Session | None = None, patience: float = threading.TIMEOUT_MAX
    ) -> Iterator[Session]:
        """Yield the session, under the node's lock.

        Parameters
        ----------
        expected
            Expected session; None: any.
        patience
            Longest time to wait for the lock [s].

        Raises
        ------
        CommandError
            The node is not active, or has another session.
        TimeoutError
            Another thread held the lock for longer than ``patience``.
        """
        if not self._turn.acquire(patience):
            raise TimeoutError
        try:
            session = self._session
            if session is None or not session.active:
                state, transition = (
                    (INACTIVE, "activate") if session else (_UNCONFIGURED, "configure")
                )
                name = self.get_fully_qualified_name()
                raise CommandError(f"{state}; `ros2 lifecycle set {name} {transition}`")
            if expected not in (None, session):
                raise CommandError("the node was configured again meanwhile; repeat the request")
            yield session
        finally:
            self._turn.release()

    def stop_when_possible(self) -> None:
        """Begin an emergency stop after the step in progress; this needs no lock."""
        if self._session is not None:
            self._session.path.stop_wanted = True

    def prepare(self, scene: Scene, values: Values, say: Say) -> PreparedDrive:
        """Prepare the drive of another scene, which may take long; the present drive continues.

        Parameters
        ----------
        scene
            Scene to prepare.
        values
            Parameters of the node.
        say
            Function that logs a text if the work takes long.
        """
        tolerance = tolerance_of(values)
        return PreparedDrive(scene, self._rates, values["error_checks"], tolerance, say)

    def scene_of(self, values: Values) -> Scene:
        """Return the scene that parameter values name.

        Raises
        ------
        SceneError, InputError
            The scene does not exist or cannot be run.
        """
        return scene_of(values["scene"], values["changes"], self._rates)

    def configure(self) -> None:
        """Load the scene that the parameters name, and compile the scene's kernels."""
        values = self.settings.values
        self._tell(Level.OK, f"configuring {values['scene']}")
        try:
            scene = self.scene_of(values)
            doing = f"configuring {scene.name}"
            self.get_logger().info(f"{doing}: new kernels take some time to compile")
            prepared = self.run_in_thread(lambda say: self.prepare(scene, values, say), doing)
            with self._turn:
                self._session = Session(self, self._outputs, self._rates, self.settings, prepared)
        except AbSimError as error:
            self._tell(Level.ERROR, f"unconfigured: {error}")
            raise
        if self.settings.values is not values:
            self._apply(values, self.settings.values)  # parameters that were set meanwhile

    def activate(self) -> None:
        """Subscribe to commands and let simulated time advance."""
        assert self._session is not None
        with self._turn:
            self._session.activate()

    def deactivate(self) -> None:
        """Stop simulated time; the drive keeps its state."""
        assert self._session is not None
        with self._turn:
            self._session.deactivate()

    def cleanup(self) -> None:
        """Unload the scene."""
        assert self._session is not None
        with self._turn:
            self._session.close()
            self._session = None
        self._tell(Level.OK, _UNCONFIGURED)

    def serve(self) -> None:
        """Advertise the services that control the node."""
        raise NotImplementedError

    def run(self, stopping: threading.Event) -> None:
        """Run the main loop until stopped: wake up, take steps, serve requests.

        Raises
        ------
        AbSimError
            The automatic start failed.
        """
        self.stopping = stopping
        if self.settings.values["autostart"]:
            with contextlib.suppress(Interrupted):
                self.start_up()
        # With autostart, services are offered after the start.
        self.serve()
        with self._turn:
            if self._session is not None:
                self._session.restart_clock()  # the start is not a late wake-up
        answered = 0.0
        with StallGuard(self, stopping, self._answer_urgently) as guard:
            while not self._stopped_after(self._rest(), stopping):
                guard.begin()
                if prompt := (now := time.monotonic()) - answered >= _PROMPT:
                    answered = now
                    super().answer()
                with self._turn:
                    if self._session is not None and self._session.active:
                        self._session.wake()
                # After the wake-up, because a report is not urgent and takes half a period.
                if prompt:
                    self._report_if_due()
                guard.end()
            guard.begin()
            with self._turn:
                if self._session is None:
                    self._outputs.diagnostics.publish(Level.OK, ENDED, logged=True)
                else:
                    self._session.finish(ENDED)

    def _answer_urgently(self) -> None:
        """Serve requests for an emergency stop while the main loop is in a long step."""
        for service in self.by_loop:
            if service.service_name == self.resolve_service_name(EMERGENCY_STOP):
                answer_waiting(service)

    def answer(self) -> None:
        """Serve requests of the main loop, and publish diagnostics if they are due."""
        super().answer()
        self._report_if_due()

    def _report_if_due(self) -> None:
        """Publish diagnostics if they are due; see ``Session.report_if_due``."""
        session, now = self._session, time.monotonic()
        if session is not None and session.active:
            with self._turn:
                session.report_if_due()
        elif now - self._reported >= PERIOD:
            self._reported = now
            if session is None:
                self._outputs.diagnostics.publish(*self._state)
            else:
                with self._turn:
                    session.report(INACTIVE)

    def _tell(self, level: Level, text: str) -> None:
        """Publish the state of a node without an active session, and repeat it once a second."""
        self._state, self._reported = (level, text), time.monotonic()
        # An error is not logged here, because the failing transition logs it.
        self._outputs.diagnostics.publish(level, text, logged=level is Level.ERROR)

    def _rest(self) -> float:
        """Return the time until the next wake-up [s]."""
        session = self._session
        return GLANCE if session is None or not session.active else session.rest()

    def _stopped_after(self, rest: float, stopping: threading.Event) -> bool:
        """Sleep for a time [s], and return whether the node is to exit."""
        # Waiting for the event takes twice the CPU time of sleeping, and on Python 3.10 depends on
        # the system clock, which may be set.
        end = time.monotonic() + rest
        while rest > GLANCE and not stopping.is_set():
            time.sleep(GLANCE)
            rest = end - time.monotonic()
        time.sleep(max(rest, 0.0))
        return stopping.is_set()

    def _check(self, values: Values) -> None:
        """Refuse parameter values that the node could not use; see ``accept_changes``."""
        faults_of(values["faults"])
        held = self.settings.values
        if values["snapshot"] != held["snapshot"]:
            check_ending(path_of(values["snapshot"]), REPORT, "snapshot")
        if any(values[name] != held[name] for name in ("scene", "changes")):
            self.scene_of(values)

    def _apply(self, before: Values, values: Values) -> None:
        """Apply changed parameters to the session.

        New error checks are created without the lock, because they compile code.
        """
        session = self._session
        if session is None:
            return
        with contextlib.suppress(Interrupted):
            checks = self.run_unless_shut_down(lambda: session.checks_for_settings(before))
            with self._turn:
                session.apply_settings(before, checks)
