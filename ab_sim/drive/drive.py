"""Running drive that is created from a scene, commanded, advanced and observed, without ROS."""

import math

import numpy as np

from ab_sim.base.errors import CommandError, SceneError, exact
from ab_sim.drive.controllers import RunController, controller_of, restored_controller
from ab_sim.drive.faults.fault import Fault, check_faults
from ab_sim.drive.faults.plant import faulty_system, held_balls
from ab_sim.drive.observation import EnergyBalance, Observation, RowReader, Snapshot
from ab_sim.drive.steps import StepPlan, Steps, diverged
from ab_sim.drive.trajectory import Trajectory, check_room
from ab_sim.engine.compiling import KeptArray
from ab_sim.engine.integrate.choose import choose_stepper, top_speed
from ab_sim.engine.integrate.vector_field import VectorField
from ab_sim.model.dynamics.assemble import start_discrete_state, start_state, system_of
from ab_sim.model.dynamics.system import TURNS, has_motor, layout_of
from ab_sim.model.spindle import ScheduledSegment, SpeedSchedule, SpeedServo
from ab_sim.model.spindle.commands import TimedSpeeds, joined
from ab_sim.model.spindle.step_ranges import (
    StepRange,
    StepResolution,
    parts,
    same_instant,
    segment_after,
)
from ab_sim.scene.model import Scene

AT_ONCE = 10_000
"""Number of steps after which samples are decimated, if not all are kept, to limit memory."""


class Drive:
    """A running drive that can be commanded, advanced step by step, and observed.

    It follows the scene's profile from t = 0 until a command takes over. The same scene and the
    same commands at the same steps give bit-identical outputs, however the steps are grouped.

    Parameters
    ----------
    scene : Scene
        Scene to simulate, with its solver.
    commanded : bool, default False
        Hold the scene's start speed until commanded, instead of its profile.
    energy_balance : bool, default False
        Also integrate motor work and losses, for ``energy()``.
    faults : tuple of Fault, optional
        Faults of the drive; see ``drive.faults``.

    Raises
    ------
    InputError
        A fault does not apply to the scene.
    SceneError
        Unknown stepper, a step beyond the stability limit, or the scene has an accuracy instead of
        a step: see ``ab_sim.resolve_accuracy``.

    Examples
    --------
    >>> import ab_sim
    >>> drive = ab_sim.Drive(ab_sim.load_scene("thesis-hold"))
    >>> run = drive.advance(50)
    >>> drive.command(150.0)
    >>> drive.advance(50)["command"][-1]
    np.float64(150.0)
    >>> drive
    <Drive thesis-hold: at 0.1 s, 4.5 rad/s, stepper rk8, step 0.001 s>
    >>> drive.observe().theta.shape
    (2,)
    """

    def __init__(
        self,
        scene: Scene,
        *,
        commanded: bool = False,
        energy_balance: bool = False,
        faults: tuple[Fault, ...] = (),
    ) -> None:
        if energy_balance and "spindle_acceleration" not in scene.effects:
            raise SceneError(
                "an energy balance needs the effect spindle_acceleration: without it the equations "
                "leave out the work of the motor's torque, and no energy balance can close"
            )
        if energy_balance and faults:
            raise ValueError(
                "a drive with faults keeps no energy balance, because losses in a shock are not "
                "counted; leave out faults or energy_balance"
            )
        check_faults(faults, scene)
        self.scene, self.faults = scene, faults
        sound = system_of(scene, energy_balance)
        self.system = faulty_system(sound, scene, faults) if faults else sound
        self._stable_to = top_speed(scene, commanded)
        # Faults add no stiffness and remove no mass that limits a step; the kernel is the same.
        self.choice = choose_stepper(scene, sound, self._stable_to)
        self.stepper = self.choice.stepper
        self.step = scene.solver.step
        self.servo = SpeedServo(scene.spindle.max_speed, scene.spindle.max_acceleration)
        self._has_motor = bool(has_motor(self.system.effects))
        self.layout = layout_of(self.system)
        self._reader = RowReader(scene, self.system)
        self.channels = self._reader.channels
        self._controlled = not commanded and scene.is_controlled
        schedule_of = (
            SpeedSchedule.at_start if commanded or self._controlled else SpeedSchedule.of_scene
        )
        self._first_schedule = schedule_of(scene)
        self._discrete_state = start_discrete_state(scene, self.system)
        self._steps = Steps(self.system, self.stepper, self.step, self._discrete_state)
        self._work, self._state = self._steps.work, self._steps.state
        self._row = KeptArray(self._room_for(1))
        self._first_step_plan = StepPlan.along(self._first_schedule, self._resolution(), 0)
        self.reset()

    def __repr__(self) -> str:
        speed = self._spindle()[1]
        return (
            f"<Drive {self.scene.name}: at {self.time:.6g} s, {speed:.4g} rad/s, "
            f"stepper {self.stepper.name}, step {self.step:g} s>"
        )

    @property
    def time(self) -> float:
        """Return the simulated time [s], the number of steps times the step."""
        return self.steps * self.step

    @property
    def events(self) -> int:
        """Return the number of events (reversals, sticking, release, impacts, motor limits)."""
        return int(self._work.counts[0])

    @property
    def steps_with_unresolved_events(self) -> int:
        """Return the number of steps with too many events, plus instants without valid branches.

        Results are less accurate there.
        """
        return int(self._work.counts[1])

    @property
    def schedule(self) -> SpeedSchedule:
        """Return the schedule of the spindle's speed, as far as it is known.

        Another schedule that is assigned applies from now on.
        """
        return self._schedule

    @schedule.setter
    def schedule(self, schedule: SpeedSchedule) -> None:
        self._schedule = schedule
        self._step_plan = StepPlan.along(schedule, self._resolution(), self.steps)

    def reset(self) -> None:
        """Return to t = 0 and the scene's start state; commands are forgotten."""
        self._to_start()
        self._take(self._step_plan, 0, self._room_for(0))
        self._start_energy = self.system.mechanical_energy(self._state, *self._spindle())
        self._reader.reset()
        self._obey(self._advance(0))

    def _to_start(self) -> None:
        self.steps = 0
        self._schedule, self._step_plan = self._first_schedule, self._first_step_plan
        self.controller = controller_of(self.scene, self.faults) if self._controlled else None
        """Controller, if the drive's profile has one; None after the first live command."""
        self._command: float | None = None
        self._acceleration = self.servo.max_acceleration
        self._state[:] = start_state(self.scene, self.system)
        if held := held_balls(self.faults):
            self._state[self.layout.rates][held] = 0.0
        self._discrete_state[:] = start_discrete_state(self.scene, self.system)
        self._work.counts[:] = 0
        self._work.smooth[0] = math.nan

    def command(self, speed: float, acceleration: float | None = None) -> None:
        """Command a spindle speed from the present instant on.

        The servo approaches the speed at constant acceleration and holds it. A command equal to the
        one in force changes nothing.

        Parameters
        ----------
        speed : float
            Speed [rad/s].
        acceleration : float, optional
            Acceleration [rad/s^2]; default: the scene's ``spindle.max_acceleration``.

        Raises
        ------
        CommandError
            Not finite, beyond ``spindle.max_speed`` or ``max_acceleration``, or, unless the drive
            was created with ``commanded``, too fast for the step that suits its profile; nothing
            has changed.
        """
        self._approach(speed, self.servo.max_acceleration if acceleration is None else acceleration)
        self.controller = None

    def follow(self, speeds: TimedSpeeds, acceleration: float) -> None:
        """Follow speeds over time from their start on; keep the present schedule until then.

        Parameters
        ----------
        speeds
            A trajectory within the limits, whose start is not in the past.
        acceleration
            Largest acceleration up to its first point [rad/s^2].

        Raises
        ------
        CommandError
            As ``command``; nothing has changed.
        """
        self._check_stable(speeds.top_speed())
        self.schedule = joined(self.schedule, self.time, speeds, acceleration)
        self._work.smooth[0] = math.nan
        self._command, self.controller = None, None

    def _approach(self, speed: float, slope: float) -> None:
        """Ramp to a speed [rad/s] at an acceleration [rad/s^2], see ``command``."""
        self._check_stable(self.servo.check(speed))
        if (speed, slope) == (self._command, self._acceleration):
            return
        now = self.time
        angle, present = self.schedule.angle(now), self.schedule.speed(now)
        self.schedule = self.servo.approach(now, angle, present, speed, slope)
        self._work.smooth[0] = math.nan
        self._command, self._acceleration = float(speed), float(slope)

    def _check_stable(self, speed: float) -> None:
        """Refuse a speed [rad/s] at which the step would be too long, and remember allowed ones."""
        if abs(speed) <= self._stable_to:
            return
        try:
            choose_stepper(self.scene, system_of(self.scene), abs(speed))
        except SceneError as error:
            raise CommandError(f"command = {exact(speed)} rad/s: {error}") from error
        self._stable_to = abs(speed)

    def advance(self, steps: int = 1, every: int = 1) -> Trajectory:
        """Advance by whole integration steps.

        Parameters
        ----------
        steps : int, default 1
            Number of steps.
        every : int, default 1
            Keep every ``every``-th sample, counted from now on.

        Returns
        -------
        Trajectory
            One sample per step, or per ``every`` steps, taken at its end. If the spindle's
            acceleration jumps at that instant, the deck acceleration is the one before the jump.

        Raises
        ------
        TypeError
            An argument is not an integer.
        ValueError
            ``steps`` is negative, ``every`` is less than 1, or there would be too many samples to
            keep.
        DivergedError
            The state went beyond all bounds; the drive keeps its last valid state.
        """
        # Live, a thousand times a second. True equals 1, and is refused below.
        if steps == 1 == every and type(steps) is type(every) is int and self.controller is None:
            self._take(self._step_plan, 1, self._row)
            self.steps += 1
            return self._reader.trajectory(self._row.array.copy())
        steps, every = check_room(steps, every, self.channels)
        if every == 1:
            return self._advance(steps)
        kept = [self._advance(0)]
        for done in range(0, steps, AT_ONCE):
            kept.append(self._advance(min(AT_ONCE, steps - done)).decimated(every, after=done))
        return Trajectory.join(kept)

    def _advance(self, steps: int) -> Trajectory:
        samples, first = self._room_for(steps), self.steps
        if self.controller is None:
            return self._record(samples)
        while self.steps < first + steps:
            part = slice(self.steps - first, self.controller.next(self.steps) - first)
            self._obey(self._record(samples[part]))
        return Trajectory(self.channels, samples)

    def _record(self, samples: np.ndarray) -> Trajectory:
        """Take one step for each row of ``samples`` and write the samples to it."""
        if steps := len(samples):
            self._take(self._step_plan, steps, samples)
            self.steps += steps
        return self._reader.trajectory(samples)

    def _obey(self, newest: Trajectory) -> None:
        """Pass the newest samples to the profile controller, if any, and apply its command."""
        speed = None if self.controller is None else self.controller.command(newest, self.steps)
        if speed is not None and self.servo.accepts(speed):  # a live drive applies this check, too
            self._approach(speed, self.servo.max_acceleration)

    def present(self) -> Trajectory:
        """Return the present state as a trajectory of one sample."""
        sample = self._room_for(1)
        self._take(self._step_plan, 0, sample)
        return self._reader.present(sample)

    def observe(self) -> Observation:
        """Return an observation of the present state."""
        return self._reader.observation(self.present(), self.time, self._discrete_state)

    def observe_at(self, time: float) -> Observation:
        """Return an observation at a time within the next step, without taking that step.

        Parameters
        ----------
        time : float
            Time [s], from now to one step later.

        Raises
        ------
        ValueError
            ``time`` is outside that range.
        """
        if not self.time <= time <= self.time + self.step * (1 + 1e-9):
            raise ValueError(
                f"time = {exact(time)} s: must lie within the next step, "
                f"{self.time} to {self.time + self.step} s"
            )
        with self._steps.left_unchanged():
            if time - self.time > same_instant(time, self.step):
                part = StepPlan(parts(self.schedule, self._resolution(), self.steps, time))
                self._take(part, 1, self._room_for(1))
            there = StepRange(self._segment_at(time), self.steps, 0, time - self.time, self.step)
            sample = self._room_for(1)
            self._take(StepPlan([there]), 0, sample)
            present = self._reader.present(sample)
            return self._reader.observation(present, time, self._discrete_state)

    def energy(self) -> EnergyBalance:
        """Return the energy balance since the start.

        Raises
        ------
        ValueError
            The drive was created without ``energy_balance=True``.
        """
        if not self.system.energy_balance:
            raise ValueError(
                "this drive keeps no energy balance: create it with energy_balance=True"
            )
        stored = self.system.mechanical_energy(self._state, *self._spindle())
        work, dissipated = self._state[self.layout.energy_balance]
        return EnergyBalance(stored, self._start_energy, float(work), float(dissipated))

    def vector_field(self) -> VectorField:
        """Return f of y' = f(t, y) along the present segment, with the active branches."""
        return VectorField(self.system, self._segment_at(self.time), self._discrete_state)

    def snapshot(self) -> Snapshot:
        """Return everything on which the drive's future depends, for ``restore``."""
        memory = self._work.memory.copy()
        # Memory of an earlier segment is stale, but ``restore`` takes all memory as valid. Zeros
        # make the stepper restart, as it does in this drive.
        if self._work.smooth[0] != self._segment_at(self.time).start:
            memory[:] = 0.0
        return Snapshot(
            self.steps,
            self.step,
            self._state.copy(),
            self._discrete_state.copy(),
            memory,
            self.schedule,
            self._command,
            self._acceleration,
            {name: pickup.state for name, pickup in self._reader.pickups.items()},
            None if self.controller is None else self.controller.state,
        )

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a snapshot of this drive or of another one with the same scene.

        Raises
        ------
        ValueError
            The snapshot does not fit; nothing has changed.
        """
        self.controller = self.check(snapshot)
        self.steps, self.schedule = snapshot.steps, snapshot.schedule
        self._command, self._acceleration = snapshot.command, snapshot.acceleration
        self._state[:] = snapshot.state
        self._discrete_state[:] = snapshot.discrete_state
        self._work.smooth[0] = math.nan
        if snapshot.memory.shape == self._work.memory.shape:
            self._work.memory[:] = snapshot.memory
            self._work.smooth[0] = self._segment_at(self.time).start
        for name, state in snapshot.pickups.items():
            self._reader.pickups[name].state = state

    def check(self, snapshot: Snapshot) -> RunController | None:
        """Refuse a snapshot that this drive cannot return to.

        Returns
        -------
        RunController or None
            Controller that would command the drive from there on.

        Raises
        ------
        ValueError
            The snapshot does not fit; the message states the difference.
        """
        snapshot.check_like(self.snapshot())
        return restored_controller(self.scene, self.faults, snapshot)

    def _resolution(self) -> StepResolution:
        return StepResolution(self.step, self.choice.cycle)

    def _segment_at(self, time: float) -> ScheduledSegment:
        return segment_after(self.schedule, time, self.step)

    def _room_for(self, steps: int) -> np.ndarray:
        """Return an uninitialised array for samples, shape (steps, channels)."""
        return np.empty((steps, len(self.channels)))

    def _take(self, step_plan: StepPlan, steps: int, samples: np.ndarray | KeptArray) -> None:
        """Take steps along a plan from the present on, without counting them yet.

        Raises
        ------
        DivergedError
            The state went out of bounds; the steps before are counted.
        """
        command = math.nan if self._command is None else self._command
        taken = step_plan.walk(self._steps.along, self.steps, steps, command, samples)
        if taken < 0:
            self.steps += -1 - taken
            self._work.smooth[0] = math.nan
            state = zip(self.layout.names, self._work.trial, self._work.bounds, strict=True)
            beyond = [name for name, x, most in state if not abs(x) < most]
            raise diverged(beyond, self.stepper, self.step, self.time + self.step)

    def _spindle(self) -> tuple[float, float]:
        """Return psi [rad], unwrapped, and w [rad/s]."""
        if self._has_motor:
            psi, omega, _ = self._state[self.layout.spindle].tolist()
            return psi + 2.0 * math.pi * float(self._discrete_state[-1, TURNS]), omega
        start, _, start_angle, segment = self._segment_at(self.time)
        local = self.time - start
        return float(start_angle + segment.angle(local)), float(segment.speed(local))
