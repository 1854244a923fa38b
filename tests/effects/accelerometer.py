"""An accelerometer reads specific force, and does nothing else."""

import numpy as np
import pytest

from tests.effects.parts import COMPANIES, Changes, FiveParts, Run, run, scene_of

CLEAN = {"noise_density": 0.0, "resolution": 0.0, "range": 1e6, "bandwidth": 500.0}


class Accelerometer(FiveParts):
    """No kernel contains it: beside gravity, and in gravity's company."""

    name = "accelerometer"
    company = "smooth"
    changes = {
        "effects": {
            "gravity": {"tilt": np.pi / 2, "direction": -np.pi / 2},
            "accelerometer": {"axis_angle": 0.3},
        }
    }
    dissipates = False

    def strength(self, run: Run) -> float:
        """Readings over g."""
        read = np.column_stack([run.trajectory[f"accelerometer_{axis}"] for axis in (1, 2)])
        assert np.ptp(read, axis=0).min() > 0.0 or np.abs(read).max() > 9.0
        return float(np.abs(read).max() / 9.80665)

    def activity(self) -> None:
        """It reads, and clips at its range."""
        self.watch()
        narrow = self.watch({"effects": {"accelerometer": {"range": 8.0}}}, least=0.5)
        read = np.abs(narrow.trajectory["accelerometer_1"])
        digit = narrow.effect("accelerometer").resolution
        clipped = read > 8.0 - digit
        assert clipped.any() and not clipped.all()
        assert read.max() <= 8.0 + 0.5 * digit, "the range, to the nearest digit"

    def direction(self) -> None:
        """Hanging at rest it shows g upwards, on its own axes."""
        rest: Changes = {
            "rotor": {"eccentricity": 0.0},
            "start": {"speed": 0.0, "ball_angles": [-np.pi / 2, -np.pi / 2]},
            "profile": None,
            "effects": {"accelerometer": CLEAN},
        }
        read = self.watch(rest, least=0.5).trajectory.samples[-1, -2:]
        assert read == pytest.approx(9.80665 * np.array([np.sin(0.3), np.cos(0.3)]), rel=1e-9)

    def rotation(self) -> None:
        """Turned with the scene it reads the same; turned alone, it reads turned axes."""
        super().rotation()
        still = {"effects": {"accelerometer": CLEAN}}
        one = self.watch(still).trajectory.samples[:, -2:] @ [1, 1j]
        whole: Changes = {
            "start": {"angle": 0.7},
            "effects": {
                "gravity": {"direction": -np.pi / 2 + 0.7},
                "accelerometer": {"axis_angle": 1.0},
            },
        }
        with_scene = self.watch(still, whole).trajectory.samples[:, -2:] @ [1, 1j]
        assert np.abs(with_scene - one).max() < 1e-6 * np.abs(one).max()
        turned = {"effects": {"accelerometer": {"axis_angle": 1.0}}}
        alone = self.watch(still, turned).trajectory.samples[:, -2:] @ [1, 1j]
        assert np.abs(alone - one * np.exp(-0.7j)).max() < 1e-9 * np.abs(one).max()

    def power(self) -> None:
        """None: the motion with it is the motion without it, bit for bit."""
        seen = self.watch().trajectory
        gravity: Changes = {"gravity": self.changes["effects"]["gravity"]}
        assert "accelerometer" not in COMPANIES[self.company]
        plain = run(scene_of(self.company, {"effects": gravity}), self.steps).trajectory
        assert seen.samples[:, :-2].tobytes() == plain.samples.tobytes()

    def limit(self) -> None:
        """Without its imperfections it reads the force, but for the low-pass' delay."""
        gaps = []
        for step in (1e-3, 1e-4):
            open_wide = {**CLEAN, "bandwidth": 0.5 / step, "sample_rate": 1.0 / step}
            change: Changes = {"solver": {"step": step}, "effects": {"accelerometer": open_wide}}
            out = self.watch(change, steps=round(0.3 / step)).trajectory
            force = (out["ax"] + 1j * (out["ay"] + 9.80665)) * np.exp(-0.3j)
            read = out.samples[:, -2:] @ [1, 1j]
            gaps.append(float(np.abs(read - force)[len(read) // 2 :].max()))
        assert gaps[1] == pytest.approx(0.1 * gaps[0], rel=0.15)


PARTS = Accelerometer()
