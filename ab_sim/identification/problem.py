"""Objective of a fit: measured minus simulated signals of all recordings, in units of noise."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ab_sim.engine.stepping.side_by_side import LANES
from ab_sim.identification.colour import whitened, whitening_of
from ab_sim.identification.forward import STEP_SHARE, RecordedDrive, SimulatedSignals
from ab_sim.identification.information import sum_of_squares
from ab_sim.identification.measured import BIAS, DELAY, GAIN, Measured
from ab_sim.identification.parameters import (
    ANGLES,
    POSITION,
    RATES,
    VELOCITY,
    FitParameter,
    encoder_zero,
    recording_parameters,
)
from ab_sim.scene.model import Scene

_BEYOND = 1e3
"""Residuals of a failed run, relative to the signals.

They are large, so that a minimiser steps back, but finite, as it needs numbers.
"""


class Problem:
    """Least-squares problem of recordings: residuals, and their derivatives by scaled parameters.

    Parameters
    ----------
    scene
        Scene to be fitted.
    common
        Parameters that all recordings share.
    recordings
        Recordings to fit.
    noise
        Standard deviation of the noise in each recording.
    """

    def __init__(
        self,
        scene: Scene,
        common: Sequence[FitParameter],
        recordings: Sequence[Measured],
        noise: Sequence[float],
    ) -> None:
        self.scene, self.common = scene, tuple(common)
        self.recordings, self.noise = tuple(recordings), tuple(noise)
        of_recordings = [
            parameter
            for number, measured in enumerate(recordings)
            for parameter in recording_parameters(scene, measured, number)
        ]
        self.parameters = (*self.common, *of_recordings, *encoder_zero(recordings))
        self._drives = [RecordedDrive(scene, measured) for measured in recordings]
        self._taps = [whitening_of(measured) for measured in recordings]
        whole = [
            whitened(*taps_and_signals)
            for taps_and_signals in zip(self._taps, self._measured, strict=True)
        ]
        self._there = [np.isfinite(residuals) for residuals in whole]
        self.runs = 0
        """Number of simulated runs."""
        self._last: dict[int, tuple[bytes, SimulatedSignals | None]] = {}

    def __reduce__(self) -> tuple[Any, ...]:
        """Return the constructor's arguments: other processes compile their own machine code."""
        return Problem, (self.scene, self.common, self.recordings, self.noise)

    @property
    def _measured(self) -> list[np.ndarray]:
        return [measured.signals for measured in self.recordings]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all parameters."""
        return tuple(parameter.name for parameter in self.parameters)

    @property
    def start(self) -> np.ndarray:
        """Start values of all parameters [SI], shape (parameters,)."""
        return np.array([parameter.start for parameter in self.parameters])

    @property
    def scales(self) -> np.ndarray:
        """Magnitude of a large change of each parameter [SI], shape (parameters,)."""
        return np.array([parameter.scale for parameter in self.parameters])

    def part(self, recordings: Sequence[int], until: float | None = None) -> "Problem":
        """Return the problem with only some recordings, whole or cut off at a time.

        The part has the common parameters and those of the chosen recordings, with new indices.

        Parameters
        ----------
        recordings
            Indices of the recordings.
        until
            Fraction of each recording to keep; None keeps all.
        """
        chosen = [self.recordings[k] for k in recordings]
        if until is not None:
            chosen = [measured.until(until * measured.duration) for measured in chosen]
        return Problem(self.scene, self.common, chosen, [self.noise[k] for k in recordings])

    def with_noise(self, noise: Sequence[float]) -> "Problem":
        """Return the problem with other standard deviations of the noise."""
        problem = Problem.__new__(Problem)
        vars(problem).update(vars(self), noise=tuple(noise))
        return problem

    def residuals(self, values: np.ndarray) -> np.ndarray:
        """Return residuals of all measured values in units of noise, shape (residuals,)."""
        parts = []
        for k, (noise, there) in enumerate(zip(self.noise, self._there, strict=True)):
            parts.append(self.whitened_residuals(k, values)[there] / noise)
        return np.concatenate(parts)

    def cost(self, values: np.ndarray) -> float:
        """Return half the sum of squares of the residuals."""
        return 0.5 * sum_of_squares(self.residuals(values))

    def whitened_residuals(self, number: int, values: np.ndarray) -> np.ndarray:
        """Return whitened residuals of a recording, shape (samples, axes).

        They are NaN where nothing was measured and until the whitening filter is filled.
        """
        return self._residuals_of(number, self._signals(number, values, ()), values)

    def derivatives(
        self, values: np.ndarray, free: Sequence[int], central: bool = True
    ) -> np.ndarray:
        """Return the derivatives that ``both`` returns, shape (residuals, free parameters)."""
        return self.both(values, free, central)[1]

    def both(
        self, values: np.ndarray, free: Sequence[int], central: bool = True
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return residuals, and their derivatives by the free parameters in units of their scales.

        Parameters
        ----------
        values
            Values of all parameters [SI].
        free
            Indices of the parameters for derivatives.
        central
            Whether differences are central; one-sided ones need half as many runs.

        Returns
        -------
        tuple[np.ndarray, np.ndarray]
            Residuals in units of noise, shape (residuals,), and derivatives, shape (residuals, free
            parameters).
        """
        residuals, blocks = [], []
        for k, (noise, there) in enumerate(zip(self.noise, self._there, strict=True)):
            places = self._affecting(k, free)
            signals = self._signals(k, values, places, central)
            residuals.append(self._residuals_of(k, signals, values)[there] / noise)
            block = np.zeros((int(there.sum()), len(free)))
            if signals is not None:
                for j, column in zip(
                    places, self._columns(k, signals, values, places), strict=True
                ):
                    block[:, free.index(j)] = whitened(self._taps[k], column)[there]
            blocks.append(-block / noise)
        return np.concatenate(residuals), np.concatenate(blocks) * self.scales[list(free)]

    def costs_no_more(self, free: Sequence[int], central: bool) -> bool:
        """Return whether ``both`` costs no more than ``residuals``: all its runs fit in lanes."""
        sides = 2 if central else 1
        return all(
            drive.side_by_side and sides * len(self._affecting(k, free)) < LANES
            for k, drive in enumerate(self._drives)
        )

    def _affecting(self, number: int, free: Sequence[int]) -> list[int]:
        """Return the indices in ``free`` of the parameters on which a recording depends."""
        return [j for j in free if self.parameters[j].belongs_to(number)]

    def _residuals_of(
        self, number: int, signals: SimulatedSignals | None, values: np.ndarray
    ) -> np.ndarray:
        """Return a recording's whitened residuals; large ones for None, a failed run."""
        measured = self.recordings[number].signals
        if signals is None:
            return _BEYOND * whitened(self._taps[number], measured)
        simulated = self._with_gain_and_bias(number, signals, values)
        return whitened(self._taps[number], measured - simulated)

    def simulated(
        self, number: int, values: np.ndarray, also: Mapping[str, Any] | None = None
    ) -> np.ndarray | None:
        """Return the simulated signals with gain and bias, shape (samples, axes); None on failure.

        Parameters
        ----------
        number
            Index of the recording.
        values
            Values of all parameters [SI].
        also
            Further values of the scene, by dotted key.
        """
        signals = self._signals(number, values, (), also=also)
        return None if signals is None else self._with_gain_and_bias(number, signals, values)

    def scene_values(self, values: np.ndarray, number: int | None = None) -> dict[str, Any]:
        """Return values of the scene by dotted key.

        Parameters
        ----------
        values
            Values of all parameters [SI].
        number
            Index of the recording; None for the values that all recordings share.
        """
        by_key: dict[str, Any] = {}
        if number is not None:
            measured = self.recordings[number]
            balls = self.scene.balls.count if measured.with_balls else 0
            if balls:
                by_key[ANGLES] = [0.0] * balls
                if not measured.at_rest:
                    by_key[RATES] = [0.0] * balls
            if not measured.at_rest:
                by_key[POSITION], by_key[VELOCITY] = [0.0, 0.0], [0.0, 0.0]
        for parameter, value in zip(self.parameters, values.tolist(), strict=True):
            if parameter.key is not None and parameter.belongs_to(number):
                base = 0.0 if number is None else parameter.bases.get(number, 0.0)
                by_key[parameter.key] = base + value
        return by_key

    def _signals(
        self, number: int, values: np.ndarray, free: Sequence[int], central: bool = True,
        also: Mapping[str, Any] | None = None,
    ) -> SimulatedSignals | None:  # fmt: skip
        """Return the simulated signals of a recording; the last run without extras is cached."""
        if free or also:
            return self._run(number, values, free, central, also or {})
        key, cached = values.tobytes(), self._last.get(number)
        if cached is None or cached[0] != key:
            cached = self._last[number] = key, self._run(number, values, (), central, {})
        return cached[1]

    def _run(
        self, number: int, values: np.ndarray, free: Sequence[int], central: bool,
        also: Mapping[str, Any],
    ) -> SimulatedSignals | None:  # fmt: skip
        """Simulate a recording, with derivatives by the scene's values and delay in ``free``."""
        drive, measured = self._drives[number], self.recordings[number]
        keys = [(j, self.parameters[j].key) for j in free]
        moved = [(j, key) for j, key in keys if key is not None]
        delays = self._nuisances(number, DELAY, values)
        self.runs += 1 + (2 if central else 1) * len(moved)
        return drive.signals(
            {**self.scene_values(values, number), **also},
            [key for _, key in moved],
            [STEP_SHARE * self.parameters[j].scale for j, _ in moved],
            delays[0] if delays else measured.delay,
            bool(delays),
            central,
        )

    def _nuisances(self, number: int, nuisance: str, values: np.ndarray) -> list[float]:
        """Return the fitted values of a recording's gain, biases or delay; empty if not free."""
        return [
            float(value)
            for parameter, value in zip(self.parameters, values, strict=True)
            if parameter.recording == number and parameter.nuisance == nuisance
        ]

    def _with_gain_and_bias(
        self, number: int, signals: SimulatedSignals, values: np.ndarray
    ) -> np.ndarray:
        """Return simulated signals with the sensor's gain and bias, shape (samples, axes)."""
        gain, bias = self._nuisances(number, GAIN, values), self._nuisances(number, BIAS, values)
        scaled = signals.values * gain[0] if gain else signals.values
        return scaled + np.array(bias) if bias else scaled

    def _columns(
        self, number: int, signals: SimulatedSignals, values: np.ndarray, places: Sequence[int]
    ) -> list[np.ndarray]:
        """Return the derivatives of the signals by parameters, each of shape (samples, axes)."""
        gains = self._nuisances(number, GAIN, values)
        gain, derivatives = (gains[0] if gains else 1.0), iter(signals.derivatives)
        columns = []
        for j in places:
            parameter = self.parameters[j]
            if parameter.key is not None:
                columns.append(gain * next(derivatives))
            elif parameter.nuisance == GAIN:
                columns.append(signals.values)
            elif parameter.nuisance == DELAY:
                columns.append(-gain * signals.slope)
            else:
                column = np.zeros(signals.values.shape)
                column[:, parameter.axis] = 1.0
                columns.append(column)
        return columns
