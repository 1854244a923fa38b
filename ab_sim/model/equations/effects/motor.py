"""A motor of finite torque: the spindle speed follows from the equations of motion."""

from typing import TYPE_CHECKING, Annotated, NamedTuple

from ab_sim.scene.quantities import Number, quantity
from ab_sim.scene.registry import register

if TYPE_CHECKING:
    from ab_sim.scene.model import Scene


@register(
    "motor",
    equation="T = clip(T_a, +-T_max) - b w, T_a = k_p (w_c - w) + k_i z, z' = w_c - w - (T_a - "
    "clip(T_a)) / k_p",
    source="Sommerfeld effect: Dimentberg et al. (1997), Shock and Vibration 4; direct-current "
    "motor at limited voltage; anti-windup by back-calculation: Astrom and Murray, Feedback "
    "Systems (2008), 10.4",
)
class Motor(NamedTuple):
    """Speed loop with torque limit and back-EMF; unbalance and balls react on the rotor.

    The profile and live commands give the commanded speed w_c. A motor that is too weak stays
    caught at the critical speed. The times at which the torque reaches and leaves its limit are
    located within a step.
    """

    rotor_inertia: Annotated[
        Number,
        quantity(
            "I_r, inertia of rotor and disc about the shaft without M0 e^2; for a deck in "
            "space: of turning parts in addition to rotor.inertia",
            "kg m^2",
            ge=0,
        ),
    ]
    torque_limit: Annotated[
        Number,
        quantity("T_max, largest torque at standstill; 0: motor switched off", "N m", ge=0, le=1e6),
    ]
    proportional_gain: Annotated[
        Number,
        quantity(
            "k_p, torque per speed error (to switch the motor off: torque_limit 0)",
            "N m s/rad",
            gt=0,
            le=1e6,
        ),
    ]
    integral_gain: Annotated[
        Number, quantity("k_i, torque per integral of the speed error", "N m/rad", ge=0, le=1e6)
    ] = 0.0
    back_emf_slope: Annotated[
        Number, quantity("b, loss of torque per speed", "N m s/rad", ge=0, le=1e6)
    ] = 0.0

    def rotor_moment(self) -> float:
        return self.rotor_inertia

    def loop_torque(self, error: float, integral: float) -> float:
        return self.proportional_gain * error + self.integral_gain * integral

    def integral_rate(self, error: float, excess: float) -> float:
        # The integral follows the delivered torque, so it does not wind up at the limit.
        return error - excess / self.proportional_gain

    def largest_torque(self) -> float:
        return self.torque_limit

    def back_torque(self, speed: float) -> float:
        return self.back_emf_slope * speed

    def check_scene(self, scene: "Scene") -> None:
        """Refuse a motor without inertia, or without the effect of the spindle's acceleration."""
        # On a free deck, M0 turns about the mass centre of all that is not free to roll.
        eccentric = scene.eccentric_mass
        share = 1.0 - eccentric / (scene.total_mass - scene.balls.total_mass)
        if scene.deck is None and self.rotor_inertia == 0.0:
            if share > 1e-9 and scene.rotor.eccentricity > 0.0:
                return
            raise ValueError(
                "effects.motor.rotor_inertia = 0.0 kg m^2: must be more than 0; the rotor of a "
                "scene without a deck in space has no other inertia, unless rotor.eccentric_mass "
                "is less than all that moves besides the balls"
            )
        if "spindle_acceleration" not in scene.effects:
            raise ValueError(
                "effects.motor: needs the effect spindle_acceleration too, because the spindle's "
                "acceleration depends on how unbalance and balls react to it; name both"
            )
