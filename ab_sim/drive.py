"""One running drive: give it a scene, command it, advance it, look at it. No ROS in here."""

import math
from typing import Any

import numpy as np

import ab_sim
from ab_sim.dynamics.assemble import (
    friction_kick,
    linear_rates,
    start_state,
    state_bounds,
    state_names,
    system_of,
)
from ab_sim.dynamics.driving_force import driving_force
from ab_sim.dynamics.ledger import mechanical_energy
from ab_sim.dynamics.motion import Deck
from ab_sim.dynamics.scratch import WIDTH
from ab_sim.errors import DivergedError, SceneError
from ab_sim.integrate.fixed_step import Workspace, acceleration_at, advance
from ab_sim.integrate.limits import check_step
from ab_sim.integrate.registry import stepper_named
from ab_sim.observation import Energy, Observation, Snapshot
from ab_sim.scene.model import Scene
from ab_sim.spindle import Piece, SpeedProfile, SpeedServo
from ab_sim.trajectory import Trajectory, channels_for

MAX_KICK = 1.0
"""rad/s that friction may change a ball's speed by in one step."""


def describe(scene: Scene) -> dict[str, Any]:
    """What a run of the scene consists of, as JSON-able values, to be kept with its results.

    ``check_scene(describe(scene)["scene"], "a recording")`` gives the scene back.
    """
    return {
        "version": ab_sim.__version__,
        "scene": scene.as_mapping(),
        "effects": list(scene.effects),
        "stepper": scene.solver.stepper,
        "step": scene.solver.step,
        "race_radius": scene.race.radius,
        "eccentricity": scene.rotor.eccentricity,
        "balls": scene.balls.count,
        "ball_radius": scene.balls.radius,
    }


class Drive:
    """A drive in motion.

    It follows the scene's profile from t = 0 until a command takes over. The same scene and the
    same commands at the same steps give bit-identical outputs, however the steps are grouped.

    Args:
        scene: what to simulate.
        commanded: hold the scene's start speed until commanded, instead of its profile.
        ledger: also integrate motor work and losses, for ``energy()``.

    Raises:
        SceneError: unknown stepper, or a step beyond the stability limit.
    """

    def __init__(self, scene: Scene, *, commanded: bool = False, ledger: bool = False) -> None:
        if ledger and "spindle_acceleration" not in scene.effects:
            raise SceneError(
                "a ledger needs the effect spindle_acceleration: without it the equations leave "
                "out what the motor's torque does, and no energy balance can close"
            )
        self.scene = scene
        self.system = system_of(scene, ledger)
        self.stepper = stepper_named(scene.solver.stepper)
        self.step = scene.solver.step
        check_step(self.stepper, self.step, linear_rates(self.system, scene.spindle.max_speed))
        self._check_friction()
        self.servo = SpeedServo(scene.spindle.max_speed, scene.spindle.max_acceleration)
        self.channels = channels_for(scene.balls.count)
        self._first_profile = (
            SpeedProfile.constant(scene.start.speed) if commanded else SpeedProfile.of_scene(scene)
        )
        balls, states = scene.balls.count, start_state(scene, self.system).size
        self._work = Workspace(
            np.zeros((self.stepper.stages, states)),
            np.zeros(states),
            np.zeros((balls, WIDTH)),
            state_bounds(self.system, self.step),
        )
        self.reset()

    @property
    def time(self) -> float:
        """Simulated time [s]: whole steps times the step."""
        return self.steps * self.step

    def reset(self) -> None:
        """Back to t = 0 and the scene's start state; commands are forgotten."""
        self.steps = 0
        self.profile = self._first_profile
        self._command: float | None = None
        self._state = start_state(self.scene, self.system)
        self._start_energy = self._stored_energy(self._state, 0.0)

    def command(self, speed: float) -> None:
        """Ask for a spindle speed [rad/s] from the present instant on.

        The servo goes there at the scene's ``spindle.max_acceleration`` and holds it. A command
        equal to the one in force changes nothing.

        Raises:
            CommandError: not finite, or beyond ``spindle.max_speed``; nothing has changed.
        """
        self.servo.check(speed)
        if speed == self._command:
            return
        now = self.time
        angle, present = self.profile.angle(now), self.profile.speed(now)
        self.profile = self.servo.approach(now, angle, present, speed)
        self._command = float(speed)

    def advance(self, steps: int = 1) -> Trajectory:
        """Take whole integration steps.

        Returns:
            One sample per step, taken at its end. Where the spindle's acceleration jumps just
            there, the sample's deck acceleration is the one before the jump.

        Raises:
            ValueError: steps is negative.
            DivergedError: the state went beyond all bounds; the drive keeps its last good one.
        """
        if steps < 0:
            raise ValueError(f"steps = {steps}: must be at least 0")
        rows = np.empty((steps, self._state.size + 2))
        spindle = np.empty((steps, 2))
        done = 0
        while done < steps:
            piece = self._piece_at(self.time)
            whole = self._steps_until(piece.end, steps - done)
            if whole:
                self._integrate(piece, 0.0, self.step, rows[done : done + whole])
            else:
                whole = 1
                piece = self._split_step((self.steps + 1) * self.step, rows[done : done + 1])
            self.steps += whole
            local = np.arange(self.steps - whole + 1, self.steps + 1) * self.step - piece.start
            spindle[done : done + whole, 0] = piece.start_angle + piece.segment.angle(local)
            spindle[done : done + whole, 1] = piece.segment.speed(local)
            done += whole
        return self._trajectory(rows, spindle)

    def present(self) -> Trajectory:
        """The present as a trajectory of one sample."""
        now = self.observe()
        row = np.empty((1, len(self.channels)))
        row[0, :5] = now.steps, now.time, now.psi, now.omega, now.command
        row[0, 5:11] = *now.position, *now.velocity, *now.acceleration
        row[0, 11::2], row[0, 12::2] = now.theta, now.theta_rate
        return Trajectory(self.channels, row)

    def observe(self) -> Observation:
        """The drive now."""
        return self._observation(self.time, self._state)

    def observe_at(self, time: float) -> Observation:
        """The drive at a time within the next step, which is not taken by this.

        Args:
            time: s, from now to one step later.

        Raises:
            ValueError: outside that range.
        """
        if not self.time <= time <= self.time + self.step * (1 + 1e-9):
            raise ValueError(
                f"time = {time} s: must lie within the next step, "
                f"{self.time} to {self.time + self.step} s"
            )
        kept = self._state.copy()
        try:
            if time - self.time > self._snap(time):
                self._split_step(time, np.empty((1, kept.size + 2)))
            return self._observation(time, self._state)
        finally:
            self._state[:] = kept

    def energy(self) -> Energy:
        """The energy balance since the start.

        Raises:
            ValueError: the drive was made without ``ledger=True``.
        """
        if not self.system.ledger:
            raise ValueError("this drive keeps no ledger: make it with ledger=True")
        stored = self._stored_energy(self._state, self.time)
        work, dissipated = self._state[-2:]
        return Energy(stored, self._start_energy, float(work), float(dissipated))

    def snapshot(self) -> Snapshot:
        """The present, to return to with ``restore``."""
        return Snapshot(self.steps, self.step, self._state.copy(), self.profile, self._command)

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a snapshot of this drive or of another one with the same scene."""
        if snapshot.state.shape != self._state.shape or snapshot.step != self.step:
            raise ValueError("the snapshot is of a drive with other balls, step or ledger")
        self.steps, self.profile, self._command = (
            snapshot.steps,
            snapshot.profile,
            snapshot.command,
        )
        self._state = snapshot.state.copy()

    def _check_friction(self) -> None:
        # Reversals are not located within a step: friction that turns a ball round at one blow
        # would only make it chatter.
        kick = friction_kick(self.system, self.scene.spindle.max_speed)
        if kick * self.step > MAX_KICK:
            raise SceneError(
                f"solver.step = {self.step:g} s: friction changes a ball's speed by "
                f"{kick * self.step:.3g} rad/s within one step at spindle.max_speed; reversals "
                f"are not located, so at most {MAX_KICK:g} rad/s can be followed: use a step of "
                f"at most {MAX_KICK / kick:.2g} s, less friction or a lower spindle.max_speed"
            )

    def _snap(self, time: float) -> float:
        """How far apart two times may be and still be the same instant."""
        return max(1e-9 * self.step, 4.0 * math.ulp(time))

    def _piece_at(self, time: float) -> Piece:
        return self.profile.piece_at(time + self._snap(time))

    def _steps_until(self, end: float, most: int) -> int:
        """Whole steps from now that end at or before ``end`` [s], at most ``most``."""
        ahead = (end - self.time) / self.step
        if ahead > most + 1:
            return most
        count = max(math.floor(ahead) - 1, 0)
        while count < most and (self.steps + count + 1) * self.step <= end + self._snap(end):
            count += 1
        return count

    def _split_step(self, end: float, row: np.ndarray) -> Piece:
        """Integrate from now to ``end`` [s], restarting at every breakpoint in between.

        Returns the piece of the profile in which that ended.
        """
        begin = now = self.time
        while True:
            piece = self._piece_at(now)
            until = piece.end if piece.end < end - self._snap(end) else end
            self._integrate(piece, now - begin, until - now, row)
            if until == end:
                return piece
            now = until

    def _integrate(self, piece: Piece, offset: float, length: float, rows: np.ndarray) -> None:
        clock = (self.steps, self.step, offset)
        taken = advance(
            self.system,
            piece.segment,
            self.stepper.weights,
            piece.start,
            clock,
            length,
            self._state,
            self._work,
            rows,
        )
        if taken < len(rows):
            self.steps += taken
            self._diverged(rows[taken])

    def _diverged(self, bad: np.ndarray) -> None:
        names = state_names(self.system)
        wrong = [
            n
            for n, x, most in zip(names, bad, self._work.bounds, strict=False)
            if not abs(x) < most
        ]
        if len(wrong) > 3:
            wrong = [*wrong[:3], f"{len(wrong) - 3} more"]
        cause = "the step is too long for the scene's masses, stiffness and drag"
        if any(name.endswith("rate") for name in wrong):
            cause = (
                "a ball turns more than 3 rad along the race within one step, which "
                f"{self.stepper.name} cannot follow: the whirl is large for the race, or the step "
                "is too long"
            )
        raise DivergedError(
            f"{', '.join(wrong)} went beyond all bounds at t = {self.time + self.step:.9g} s; "
            f"likely cause: {cause}; try solver.step = {self.step / 4:.2g} s"
        )

    def _stored_energy(self, state: np.ndarray, time: float) -> float:
        n = self.scene.balls.count
        u1, u2, v1, v2 = state[:4].tolist()
        deck = Deck(u1, u2, v1, v2, self.profile.speed(time), 0.0)
        return mechanical_energy(self.system, deck, state[4 : 4 + n], state[4 + n : 4 + 2 * n])

    def _trajectory(self, rows: np.ndarray, spindle: np.ndarray) -> Trajectory:
        n = self.scene.balls.count
        samples = np.empty((len(rows), len(self.channels)))
        samples[:, 0] = np.arange(self.steps - len(rows) + 1, self.steps + 1)
        samples[:, 1] = samples[:, 0] * self.step
        samples[:, 2:4] = spindle
        samples[:, 4] = spindle[:, 1] if self._command is None else self._command
        c, s = np.cos(spindle[:, 0]), np.sin(spindle[:, 0])
        for column, first in ((5, 0), (7, 2), (9, rows.shape[1] - 2)):
            one, two = rows[:, first], rows[:, first + 1]
            samples[:, column] = c * one - s * two
            samples[:, column + 1] = s * one + c * two
        samples[:, 11::2] = rows[:, 4 : 4 + n]
        samples[:, 12::2] = rows[:, 4 + n : 4 + 2 * n]
        return Trajectory(self.channels, samples)

    def _observation(self, time: float, state: np.ndarray) -> Observation:
        n = self.scene.balls.count
        piece = self._piece_at(time)
        local = time - piece.start
        psi = float(piece.start_angle + piece.segment.angle(local))
        omega = float(piece.segment.speed(local))
        rotation = np.array([[math.cos(psi), -math.sin(psi)], [math.sin(psi), math.cos(psi)]])
        A = acceleration_at(self.system, piece.segment, local, state, self._work)
        position, theta, rate = rotation @ state[:2], state[4 : 4 + n], state[4 + n : 4 + 2 * n]
        return Observation(
            time=time,
            steps=self.steps,
            psi=psi,
            omega=omega,
            command=omega if self._command is None else self._command,
            u=state[:2].copy(),
            v=state[2:4].copy(),
            position=position,
            velocity=rotation @ state[2:4],
            acceleration=rotation @ np.array(A),
            theta=theta.copy(),
            theta_rate=rate.copy(),
            driving_force=driving_force(
                self.scene, position[0], position[1], psi + theta, omega + rate
            ),
        )
