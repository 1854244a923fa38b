"""Scene as a MuJoCo model; MuJoCo comes with the extra ``peers``.

The deck is on two slides with springs and dampers. The rotor with the unbalance is on a hinge on
the deck. Each ball is a point mass at the race's radius, on a separate hinge on the rotor. Two
parts are not bodies:

- the spindle follows the profile because its hinge's inertia is too large for anything to move it;
- the spin of a ball that rolls without slipping is, with I/a^2 along the race, an inertia
  (I/a^2) R^2 on the ball's hinge and a torque (I/a) R al.
"""

from typing import Any

import numpy as np

from ab_sim.analysis.accuracy_cost.methods import FailedError
from ab_sim.analysis.accuracy_cost.problem import SAME_INSTANT, SampleTimes
from ab_sim.base.errors import SceneError
from ab_sim.drive.accuracy.trials import Samples
from ab_sim.model.equations.motion import Ball
from ab_sim.model.equations.neighbours import start_angles
from ab_sim.model.equations.sums import over_effects
from ab_sim.model.spindle import SpeedSchedule
from ab_sim.model.spindle.schedule import Ramp
from ab_sim.scene.model import Scene

_KNOWN = {"suspension", "viscous_drag", "spindle_acceleration", "ball_spin"}
"""Effects that the MuJoCo model represents."""
_IMMOVABLE = 1e15
"""Inertia of the spindle over that of rotor and balls, whose reaction is thus below rounding."""
_LEAST = 1e-14
"""Inertia close to MuJoCo's minimum, in units in which a ball's inertia m R^2 is about 1."""


def mujoco_refusal(scene: Scene) -> str:
    """Return the reason why MuJoCo cannot represent a scene; empty if it can."""
    if scene.deck is not None:
        return "the MuJoCo model here covers only a deck in the plane"
    others = [name for name in scene.effects if name not in _KNOWN]
    if others:
        return f"the MuJoCo model here lacks {', '.join(others)}"
    segments = [piece.law for piece in SpeedSchedule.of_scene(scene).segments]
    if not all(isinstance(segment, Ramp) for segment in segments):
        return "the MuJoCo model here takes only profiles of constant accelerations"
    turning = any(segment.acceleration(0.0) for segment in segments)
    if turning and "spindle_acceleration" not in scene.effects:
        return (
            "MuJoCo cannot omit the inertial force of the spindle's acceleration; add "
            "effects.spindle_acceleration"
        )
    return ""


class MuJoCo:
    """MuJoCo's RK4 at one step.

    Parameters
    ----------
    scene
        Scene to run.
    sampling
        Times at which runs are compared.
    step
        Largest step [s]; shorter ones end at sample times and breakpoints.

    Raises
    ------
    ImportError
        MuJoCo is not installed.
    SceneError
        MuJoCo cannot represent the scene.
    """

    name: str = "MuJoCo RK4"
    peer: bool = True
    tolerance: float | None = None
    evaluations: int | None = None

    def __init__(self, scene: Scene, sampling: SampleTimes, step: float) -> None:
        import mujoco

        refusal = mujoco_refusal(scene)
        if refusal:
            raise SceneError(f"MuJoCo cannot represent {scene.name}: {refusal}")
        self.mujoco: Any = mujoco
        # By default MuJoCo prints, and writes a log into the working directory. Failures are
        # reported here instead.
        mujoco.set_mju_user_warning(lambda text: None)
        self.scene, self.sampling = scene, sampling
        self.step: float | None = step
        self.length = step
        self.profile = SpeedSchedule.of_scene(scene)
        effects = tuple(scene.effects.values())
        balls = [
            Ball(*values) for values in zip(scene.balls.masses, scene.balls.radii, strict=True)
        ]
        R = scene.race.radius
        spins = [over_effects(effects, "ball_inertia", 0.0, ball) for ball in balls]
        # Scale all masses, so that MuJoCo's least inertia is negligible for the lightest ball.
        size = min([ball.mass for ball in balls], default=scene.total_mass) * R * R
        self.unit = 1.0 / size
        self.spin_torque = np.array(
            [
                spin * ball.radius * R if spin else 0.0
                for spin, ball in zip(spins, balls, strict=True)
            ]
        )
        self.spindle = _IMMOVABLE * scene.total_mass * (R + scene.rotor.eccentricity) ** 2
        drags = [over_effects(effects, "ball_drag", 0.0, ball) * R * R for ball in balls]
        self.model = mujoco.MjModel.from_xml_string(
            self._xml([ball.mass for ball in balls], drags, [spin * R * R for spin in spins])
        )
        self.data = mujoco.MjData(self.model)

    def _xml(self, masses: list[float], drags: list[float], spins: list[float]) -> str:
        """Return the model as MJCF.

        Parameters
        ----------
        masses
            Mass of each ball [kg].
        drags
            Drag torque per angular speed of each ball [N m s/rad].
        spins
            Inertia of each ball's spin about the shaft, (I/a^2) R^2 [kg m^2].
        """
        scene, unit, least = self.scene, self.unit, _LEAST
        suspension = scene.effects.get("suspension")
        k, c = (suspension.stiffness, suspension.damping) if suspension else (0.0, 0.0)
        rotor = scene.eccentric_mass
        # Every moving body must have a mass: if all mass is eccentric, the deck gets a tiny one.
        deck = max(scene.total_mass - scene.balls.total_mass - rotor, 1e-14 * scene.total_mass)
        inertia = f'diaginertia="{least} {least} {least}"'
        slide = f'type="slide" stiffness="{unit * k!r}" damping="{unit * c!r}"'
        balls = "".join(
            f'<body><joint type="hinge" axis="0 0 1" damping="{unit * drag!r}" '
            f'armature="{unit * spin!r}"/>'
            f'<inertial pos="{scene.race.radius!r} 0 0" mass="{unit * m!r}" {inertia}/></body>'
            for m, drag, spin in zip(masses, drags, spins, strict=True)
        )
        return f"""<mujoco><option integrator="RK4" gravity="0 0 0" timestep="{self.length!r}"/>
        <worldbody><body>
          <joint {slide} axis="1 0 0"/><joint {slide} axis="0 1 0"/>
          <inertial pos="0 0 0" mass="{unit * deck!r}" {inertia}/>
          <body>
            <joint type="hinge" axis="0 0 1" armature="{unit * self.spindle!r}"/>
            <inertial pos="{scene.rotor.eccentricity!r} 0 0" mass="{unit * rotor!r}" {inertia}/>
            {balls}
          </body>
        </body></worldbody></mujoco>"""

    def prepare(self) -> None:
        """Return to the start."""
        self.mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[2] = self.scene.start.angle
        self.data.qpos[3:] = start_angles(self.scene)
        self.data.qvel[2] = self.scene.start.speed
        start = self.scene.start
        self.data.qpos[:2] = start.deck.position or 0.0
        self.data.qvel[:2] = start.deck.velocity or 0.0
        self.data.qvel[3:] = start.ball_rates or 0.0

    def run(self) -> np.ndarray:
        """Return the positions of all joints at the sample times; steps end at breakpoints."""
        kept: list[np.ndarray] = []
        now, times = 0.0, self.sampling.times
        for piece in self.profile.segments:
            end = min(piece.end, self.sampling.end)
            if end - now < SAME_INSTANT:
                continue
            al = piece.law.acceleration(0.0)
            self.data.qfrc_applied[2] = self.unit * self.spindle * al
            self.data.qfrc_applied[3:] = self.unit * self.spin_torque * al
            for time in times[len(kept) :]:
                if time > end + SAME_INSTANT:
                    break
                now = self._advance(now, time)
                kept.append(self.data.qpos.copy())
            now = self._advance(now, end)
        bad = self.mujoco.mjtWarning
        for what in (bad.mjWARN_BADQPOS, bad.mjWARN_BADQVEL, bad.mjWARN_BADQACC):
            if self.data.warning[what].number:
                raise FailedError("diverged: MuJoCo met values that are huge or not finite")
        return np.array(kept)

    def _advance(self, now: float, until: float) -> float:
        """Take equal steps between two times [s]; return the second one."""
        if until - now > SAME_INSTANT:
            steps = int(np.ceil((until - now) / self.length - 1e-6))
            self.model.opt.timestep = (until - now) / steps
            self.mujoco.mj_step(self.model, self.data, nstep=steps)
        return float(until)

    def samples(self, kept: np.ndarray) -> Samples:
        """Return samples: slides are the deck's displacement, hinges the balls' angles."""
        return Samples(kept[:, :2], kept[:, 3:])

    def energy_error(self) -> float | None:
        """Return None: MuJoCo keeps no balance of the motor's work and of losses."""
        return None
