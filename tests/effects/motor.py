"""Motor: it accelerates the spindle towards the command, up to its torque limit."""

import numpy as np
import pytest

from tests.effects.parts import NO_LOSSES, Changes, FiveParts, Run, closes

BARE: Changes = {
    "balls": {"count": 0},
    "rotor": {"eccentricity": 0.0},
    "start": {"speed": 50.0, "ball_angles": []},
    "profile": None,
}


class Motor(FiveParts):
    name = "motor"
    company = "motor"
    dissipates = False
    least = 5e-3

    def strength(self, run: Run) -> float:
        """Return the largest relative difference of the speed from the command."""
        out = run.trajectory
        return float(np.abs(out["speed"] / out["command"] - 1.0).max())

    def activity(self) -> None:
        """Check that the speed lags, and that a weak motor reaches its limit and lags more."""
        self.watch()
        weak = self.watch({"effects": {"motor": {"torque_limit": 8e-4}}})
        assert weak.discrete_state[:, 2, 0].max() == 1 and weak.drive.events > 0
        given = weak.trajectory["motor_torque"] + 1e-6 * weak.trajectory["speed"]
        assert given.max() == pytest.approx(8e-4, rel=1e-12)
        ahead = self.watch({"start": {"motor_integral": 0.5}})
        assert ahead.states[0, ahead.drive.layout.spindle][2] == 0.5
        off = {"effects": {"motor": {"torque_limit": 0.0, "back_emf_slope": 0.0}}}
        assert not self.watch(off, least=0.0).trajectory["motor_torque"].any()

    def direction(self) -> None:
        """Check that the torque points to the command, is limited and is reduced by back-EMF."""
        for behind in (4.0, -4.0, 40.0, -40.0):
            speed = 50.0 - behind
            asked = np.clip(1e-3 * behind, -1e-2, 1e-2) - 1e-6 * speed
            gained = self.slope(BARE, spindle=[0.0, speed, 0.0]).spindle
            assert gained[1] == pytest.approx(asked / 2e-5, rel=1e-4)
        self.watch()

    def power(self) -> None:
        """Check that the motor's work is torque times speed and is stored if nothing dissipates."""
        super().power()
        seen = self.watch({"effects": NO_LOSSES["motor"]})
        closes(seen)
        out = seen.trajectory
        work = seen.integral(out["motor_torque"] * out["speed"])
        assert seen.energies[-1].motor_work == pytest.approx(work, rel=0.01)

    def limit(self) -> None:
        """Check that a stiffer loop approaches a prescribed speed."""

        def stiff(size: float) -> Changes:
            gain = {"proportional_gain": 0.1 / size, "integral_gain": 0.0, "torque_limit": 1e3}
            return {"effects": {"motor": gain}}

        self.vanishes(stiff, {"solver": {"step": 2e-5}}, without={}, steps=10000)


PARTS = Motor()
