"""Checks of a recording before the fit; each fault has its own error message."""

import math
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ab_sim.base.errors import InputError, exact

_FEWEST = 50
"""Least number of samples of a recording."""
REPEATED = 0.05
"""Fraction of repeated times above which rounding is the likely reason."""
_FEWEST_TURNS = 2.0
"""Least number of spindle revolutions of a recording."""
_PER_TURN = 4.0
"""Least number of samples per spindle revolution at top speed."""
GAP = 20
"""Largest distance of adjacent samples, in median sampling intervals; a larger one is a gap."""
_MOST_LEFT_OUT = 0.05
"""Largest fraction of a signal's samples that may be NaN."""
FLAT = 3
"""Number of successive equal samples at an extreme value from which on a signal may be clipped."""
_CLIPPED = 3
"""Number of runs of ``FLAT`` equal samples at one extreme value that may mean clipping."""
_AT_PEAK = 4.0
"""Ratio of the number of samples at an extreme value to that at the next value.

A larger ratio means clipping.
"""
_STAYS = 2.0
"""Largest number of spindle revolutions for which a reading away from its mean may be constant."""
_OFF_MEAN = 0.1
"""Largest distance from the mean, relative to the r.m.s., of a constant reading that is accepted.

The reading of a deck at rest is constant near the mean.
"""
PARTS, APART = 20, 0.02
"""Number of parts of a recording in which speed and angle are compared, and the tolerance.

The tolerance is a fraction of the top speed, after removal of a constant factor.
"""
BACKWARD = 4.0
"""Ratio of backward to forward whirl above which axes are taken as swapped."""
CIRCULATING = 0.2
"""Lowest speed of circulating balls relative to the spindle speed."""
_TURNS_OFF = 0.08
"""Largest accepted relative difference of the strongest frequency from the spindle speed."""


def check_time(time: np.ndarray, name: str) -> None:
    """Refuse times that do not belong to a single run.

    Parameters
    ----------
    time
        Times of the samples [s].
    name
        Name of the recording.

    Raises
    ------
    InputError
        There are too few times, they do not rise, or they have a gap. The message states the fault,
        its place and the remedy.
    """
    if len(time) < _FEWEST:
        raise InputError(
            f"{name}: has {len(time)} samples; must be at least {_FEWEST}; record for longer"
        )
    if not np.isfinite(time).all():
        row = int(np.flatnonzero(~np.isfinite(time))[0])
        raise InputError(f"{name}: time: row {row} is not a finite number; remove it")
    steps = np.diff(time)
    if (steps == 0.0).all():
        raise InputError(
            f"{name}: time: never changes; is it the right column, and does it have enough digits?"
        )
    if (steps < 0.0).any():
        row = int(np.flatnonzero(steps < 0.0)[0]) + 1
        raise InputError(
            f"{name}: time: goes back at row {row}, from {exact(float(time[row - 1]))} to "
            f"{exact(float(time[row]))} s; are there two drives or two runs in one file? give "
            "each in a separate file"
        )
    if (steps == 0.0).any():
        row = int(np.flatnonzero(steps == 0.0)[0]) + 1
        _, repeats = np.unique(time, return_counts=True)
        common = int(np.median(repeats))
        # Rounded times repeat irregularly or many times. If each time occurs exactly twice, the
        # file more likely holds the samples of two drives.
        digits = "its stamps have too few digits: write more, or give sampling: in the mapping"
        if common > 2 or (np.mean(repeats > 1) > REPEATED and (repeats != common).any()):
            remedy = digits
        elif common == 2:
            remedy = f"either {digits}; or there are two drives in one file: give each its own file"
        else:
            remedy = "keep one sample for each time"
        raise InputError(
            f"{name}: time: {exact(float(time[row]))} s is repeated at row {row}, and "
            f"{int((repeats > 1).sum())} of {len(repeats)} times occur more than once; {remedy}"
        )
    usual = float(np.median(steps))
    row = int(np.argmax(steps))
    if steps[row] > GAP * usual:
        raise InputError(
            f"{name}: time: no samples for {float(steps[row]):.4g} s after "
            f"{exact(float(time[row]))} s; the spindle's motion in the gap is unknown; give the "
            "part before or after the gap in a separate file"
        )


def check_finite(time: np.ndarray, values: np.ndarray, what: str, name: str) -> None:
    """Refuse spindle data with missing samples.

    Parameters
    ----------
    time
        Times of the samples [s].
    values
        Speed, angle or reading of the spindle, in any unit.
    what
        Name of the column.
    name
        Name of the recording.

    Raises
    ------
    InputError
        A sample is not a finite number.
    """
    rows = np.flatnonzero(~np.isfinite(values))
    if len(rows):
        raise InputError(
            f"{name}: {what}: row {rows[0]} is not a finite number, at {time[rows[0]]:.4g} "
            f"s ({len(rows)} of {len(values)} rows are not), but a run needs the spindle's motion; "
            "is its sensor connected? fill them in, or cut the recording there"
        )


def check_speed(time: np.ndarray, speed: np.ndarray, what: str, name: str) -> None:
    """Refuse a spindle speed that a run cannot follow.

    Parameters
    ----------
    time
        Times of the samples [s].
    speed
        Spindle speed [rad/s].
    what
        Name of the column.
    name
        Name of the recording.

    Raises
    ------
    InputError
        Samples are missing, or there are too few turns or samples per turn.
    """
    check_finite(time, speed, what, name)
    top = float(np.max(np.abs(speed)))
    turns = float(np.sum(np.abs(speed[:-1]) * np.diff(time))) / (2.0 * math.pi)
    if turns < _FEWEST_TURNS:
        raise InputError(
            f"{name}: {what}: the spindle makes {turns:.2g} turns; must be at least "
            f"{_FEWEST_TURNS:g}: record for longer, or check the unit"
        )
    between = float(np.median(np.diff(time)))
    if 2.0 * math.pi / (top * between) < _PER_TURN:
        raise InputError(
            f"{name}: {what}: at {top:.4g} rad/s there are "
            f"{2.0 * math.pi / (top * between):.2g} samples in a turn; must be at least "
            f"{_PER_TURN:g}: sample faster, or check the units of time and speed"
        )


def check_agree(time: np.ndarray, speed: np.ndarray, angle: np.ndarray, name: str) -> None:
    """Refuse a speed and an angle that contradict each other.

    Parameters
    ----------
    time
        Times of the samples [s].
    speed
        Spindle speed [rad/s].
    angle
        Unwrapped spindle angle [rad].
    name
        Name of the recording.

    Raises
    ------
    InputError
        The two differ by a factor, or from some time on.
    """
    turned, expected = np.diff(angle), 0.5 * (speed[1:] + speed[:-1]) * np.diff(time)
    whole = float(expected.sum())
    ratio = float(turned.sum()) / whole if whole else math.inf
    # A wrong unit gives a constant ratio over the whole recording. A sensor that drifts or
    # saturates agrees at first and deviates later.
    parts = np.array_split(np.arange(len(expected)), PARTS)
    lasts = np.array([float(time[rows[-1] + 1] - time[rows[0]]) for rows in parts])
    off = np.array([float((turned - expected)[rows].sum()) for rows in parts]) / lasts
    speeds = np.array([float(expected[rows].sum()) for rows in parts]) / lasts
    scale = float(off @ speeds) / float(speeds @ speeds)
    most = APART * float(np.max(np.abs(speed)))
    if (np.abs(off - scale * speeds) > most).any() and (np.abs(off) > most).any():
        first = int(np.argmax(np.abs(off) > most))
        raise InputError(
            f"{name}: the spindle's angle and its speed agree until {time[parts[first][0]]:.4g} s, "
            f"and differ by up to {np.max(np.abs(off)):.3g} rad/s afterwards; does the speed "
            "sensor drift, saturate or freeze? leave out the wrong one (--map)"
        )
    if abs(ratio - 1.0) > _TURNS_OFF:
        raise InputError(
            f"{name}: the spindle's angle grows {ratio:.4g} times as much as its speed says; "
            "check the sampling rate, and the units of time, speed and angle"
        )


def check_signal(
    time: np.ndarray, angle: np.ndarray, signal: np.ndarray, what: str, name: str
) -> str:
    """Refuse a signal without information, or with a faulty sensor.

    Parameters
    ----------
    time
        Times of the samples [s].
    angle
        Spindle angle [rad].
    signal
        Signal, NaN for missing samples.
    what
        Name of the column.
    name
        Name of the recording.

    Returns
    -------
    str
        Remark on the signal's resolution; empty if it is fine.

    Raises
    ------
    InputError
        Samples are missing, or the signal is constant, stuck or clipped.
    """
    there = np.isfinite(signal)
    missing = len(signal) - int(there.sum())
    if missing > _MOST_LEFT_OUT * len(signal):
        starts, ends = _stretches(~there)
        longest = int(np.argmax(ends - starts))
        raise InputError(
            f"{name}: {what}: {missing} of {len(signal)} samples are not finite numbers, the first "
            f"at {time[starts[0]]:.4g} s, the longest gap, {ends[longest] - starts[longest]} "
            f"samples, from {time[starts[longest]]:.4g} s on; at most "
            f"{100 * _MOST_LEFT_OUT:g} % may be missing; is the sensor connected?"
        )
    time, angle, values = time[there], angle[there], signal[there]
    low, high = float(values.min()), float(values.max())
    if low == high:
        raise InputError(
            f"{name}: {what}: is {exact(low)} all the time; is the sensor connected, and is it "
            "the right column?"
        )
    _check_stays(time, angle, values, what, name)
    return _check_clipped(time, values, what, name)


def _check_clipped(time: np.ndarray, values: np.ndarray, what: str, name: str) -> str:
    """Refuse a reading that repeatedly stays at an extreme value.

    A reading of coarse resolution stays at its peaks, too. However, its peak level is then not much
    more frequent than the level next to it: 2.4 times for a sine.
    """
    middle, size = float(values.mean()), float(values.std())
    starts, ends = _stretches(np.diff(values) == 0.0)
    long = ends - starts >= FLAT - 1
    starts, ends = starts[long], ends[long]
    levels, counts = np.unique(values[starts], return_counts=True)
    coarse = 0.0
    for level in levels[counts >= _CLIPPED].tolist():
        places = np.flatnonzero(values[starts] == level)
        meanwhile = values[starts[places[0]] : ends[places[-1]] + 1]
        # The readings of a quiet deck stay near the mean.
        if abs(level - middle) <= _OFF_MEAN * size:
            continue
        if level not in (meanwhile.min(), meanwhile.max()):
            continue
        others = meanwhile[meanwhile != level]
        next_level = others[np.argmin(np.abs(others - level))]
        if np.sum(meanwhile == level) > _AT_PEAK * np.sum(meanwhile == next_level):
            raise InputError(
                f"{name}: {what}: is clipped: it stays at {exact(level)} for {FLAT} samples or "
                f"more at {len(places)} places, the first at "
                f"{time[starts[places[0]]]:.4g} s; record with a larger range"
            )
        coarse = float(abs(next_level - level))
    if coarse:
        return (
            f"{what}: its resolution is coarse: readings are {coarse:.3g} apart, "
            f"{100.0 * coarse / size:.2g} % of their r.m.s.; record with a smaller range"
        )
    return ""


def _check_stays(
    time: np.ndarray, angle: np.ndarray, values: np.ndarray, what: str, name: str
) -> None:
    """Refuse a reading that is constant while the spindle turns."""
    same = np.concatenate([[False], np.diff(values) == 0.0])
    starts, ends = _stretches(same)
    for first, last in zip(starts - 1, ends - 1, strict=True):
        turns = abs(float(angle[last] - angle[first])) / (2.0 * math.pi)
        off = abs(float(values[first] - values.mean()))
        if turns > _STAYS and off > _OFF_MEAN * float(values.std()):
            raise InputError(
                f"{name}: {what}: repeats {exact(float(values[first]))} from "
                f"{time[first]:.4g} to {time[last]:.4g} s, for {turns:.3g} "
                "turns of the spindle; did the sensor or its line hang? give the part before or "
                "after it in a separate file"
            )


def _stretches(which: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return start and end (exclusive) indices of the runs of consecutive True values in a mask."""
    steps = np.diff(np.concatenate([[0], which.astype(np.int8), [0]]))
    return np.flatnonzero(steps > 0), np.flatnonzero(steps < 0)


class Sense(NamedTuple):
    """Remarks on the direction and the frequency of a whirl, compared with the spindle."""

    note: str = ""
    """Note for the user; empty if there is none."""
    doubt: str = ""
    """Error message if no fit explains the whirl; empty if it follows the spindle."""


def check_sense(angle: np.ndarray, whirl: np.ndarray, with_balls: bool, name: str) -> Sense:
    """Refuse a whirl against the spindle's rotation; doubt a whirl at a multiple of its speed.

    A wrong sampling rate or unit of speed causes such a multiple. A lightly damped deck that rings
    at its natural frequency at constant speed looks the same; only a fit can distinguish them.

    Parameters
    ----------
    angle
        Spindle angle at each sample [rad].
    whirl
        Two finite signals as x + i y; a single signal is real.
    with_balls
        Whether there are balls; circulating balls cause a whirl slower than the spindle.
    name
        Name of the recording.

    Returns
    -------
    Sense
        A note, a doubt or neither, for a whirl that follows the spindle.

    Raises
    ------
    InputError
        The deck whirls against the spindle's rotation.
    """
    centred = whirl - whirl.mean()
    window = np.hanning(len(centred))
    if np.iscomplexobj(whirl):
        forward = _share(centred * np.exp(-1j * angle) * window)
        backward = _share(centred * np.exp(1j * angle) * window)
        if backward > BACKWARD * forward and backward > 0.2:
            raise InputError(
                f"{name}: the deck whirls against the spindle; are the signals' axes swapped, or "
                "is one reversed (direction in the mapping), or is the sign of the speed wrong?"
            )
    strength, factor = _best_factor(centred, angle, window)
    if strength < 0.3 or abs(factor - 1.0) < _TURNS_OFF:
        return Sense()
    message = (
        f"the vibration follows {factor:.3g} times the spindle's speed, where an unbalance follows "
        "it once"
    )
    if with_balls and CIRCULATING < factor < 1.0:
        return Sense(note=f"{message}: balls circulate, or the sampling rate is wrong")
    return Sense(
        doubt=f"{name}: {message}, and no fit explains that; check the sampling rate and the "
        "unit of the speed (rad/s, rpm, Hz)"
    )


FACTORS = np.concatenate([[1.0], 1.0 / np.array([60, 2 * math.pi, 9.5493]), [60, 6.2832, 9.5493]])
"""Speed factors if rad/s, rpm and Hz are confused.

``_best_factor`` adds those of wrong sampling rates.
"""


def _best_factor(centred: np.ndarray, angle: np.ndarray, window: np.ndarray) -> tuple[float, float]:
    """Return the fraction of power at a multiple of the spindle speed, and that multiple.

    It is the strongest one. If none has twice the power at the spindle speed, return 0 and 1.
    """
    factors = np.unique(np.concatenate([FACTORS, np.geomspace(0.2, 5.0, 400)]))
    # Sort by distance from 1: the first share is that of the spindle speed itself.
    factors = factors[np.argsort(np.abs(np.log(factors)))]
    shares = np.array([_share(centred * np.exp(-1j * f * angle) * window) for f in factors])
    best = int(np.argmax(shares))
    if shares[best] < 2.0 * shares[0]:
        return 0.0, 1.0
    return float(shares[best]), float(factors[best])


def _share(turned: np.ndarray) -> float:
    """Return the fraction of power at low frequencies of a signal on rotating axes, (samples,)."""
    spectrum = np.abs(np.fft.fft(turned)) ** 2
    # A vibration that follows the axes exactly is constant on them. The band of 0.5 % on both sides
    # of 0 also contains the decay of transients.
    slow = max(3, len(turned) // 200)
    kept = float(spectrum[: slow + 1].sum() + spectrum[-slow:].sum())
    whole = float(spectrum.sum())
    return kept / whole if whole > 0.0 else 0.0


_SPIKE, _TALL, AROUND = 8.0, 3.0, 12
"""Thresholds of a spike.

``_SPIKE`` is relative to nearby deviations from a median of five samples, ``_TALL`` to the signal's
r.m.s. ``AROUND`` is the number of nearby samples on either side.
"""
_LONG, HELD, _REGULAR, _OFF_WHOLE = 0.05, 1.7, 0.9, 0.05
"""Thresholds of held series.

``_LONG``: fraction of a series without change that counts as constant. ``HELD``: mean number of
equal samples in a held series. ``_REGULAR``: fraction of equal intervals between changes.
``_OFF_WHOLE``: distance from a whole number of steps of a resolution.
"""


def spikes_in(values: np.ndarray) -> np.ndarray:
    """Return rows of spikes: one or two samples that stand out from all samples near them.

    Parameters
    ----------
    values
        Signal, NaN for missing samples.
    """
    rows = np.flatnonzero(np.isfinite(values))
    some = values[rows]
    if len(some) < _FEWEST:
        return rows[:0]
    middle = np.median(sliding_window_view(np.pad(some, 2, mode="edge"), 5), axis=1)
    off = np.abs(some - middle)
    around = sliding_window_view(np.pad(off, AROUND, mode="reflect"), 2 * AROUND + 1)
    # The third largest deviation nearby is not part of a spike of up to two samples.
    usual = np.partition(around, -3, axis=1)[:, -3]
    tall = off > max(_TALL * float(middle.std()), 1e-300)
    spikes: np.ndarray = rows[tall & (off > _SPIKE * usual)]
    return spikes


class _Repeats(NamedTuple):
    """Pattern of repeated values in a series."""

    lengths: np.ndarray
    """Lengths of runs of equal samples, without long constant stretches."""
    usual: float
    """Median of the lengths."""
    coarse: bool
    """True if the resolution is coarse: most changes are of one or two steps."""


def _repeats(values: np.ndarray) -> _Repeats | None:
    """Return the pattern of repeated values in a series; None if values hardly repeat."""
    jumps = np.abs(np.diff(values))
    changes = np.flatnonzero(jumps)
    lengths = np.diff(changes)
    # At constant speed a series may be constant for long; leave such stretches out.
    lengths = lengths[lengths < _LONG * len(values)]
    if len(lengths) < _FEWEST or lengths.sum() < HELD * len(lengths):
        return None
    usual = float(np.median(lengths))
    step = float(np.min(np.diff(np.unique(values))))
    steps = jumps[changes] / step
    whole = np.mean(np.abs(steps - np.rint(steps)) < _OFF_WHOLE) > _REGULAR
    return _Repeats(lengths, usual, bool(whole and float(np.median(steps)) < HELD))


HOLDS = (
    "is held: it changes every {:g} samples only and repeats its last value in between, which "
    "delays it by half that time; "
)


def check_held(values: np.ndarray, what: str, name: str) -> None:
    """Refuse a spindle's series that holds each value until the next one.

    A coarse resolution also repeats values. Its changes, however, are of one or two steps and
    irregular in time.

    Parameters
    ----------
    values
        Speed or angle of the spindle, in any unit.
    what
        Name of the column.
    name
        Name of the recording.

    Raises
    ------
    InputError
        The values are held; the message states the interval and the remedy.
    """
    repeats = _repeats(values)
    if repeats is None:
        return
    if repeats.coarse and np.mean(repeats.lengths == repeats.usual) < _REGULAR:
        return
    raise InputError(
        f"{name}: {what}: {HOLDS.format(repeats.usual)}interpolate it between its changes, or "
        "record it at every sample"
    )


def check_held_signal(values: np.ndarray, what: str, name: str) -> None:
    """Refuse a signal that is sampled more slowly than the rows, and held between its samples.

    Parameters
    ----------
    values
        Signal, NaN for missing samples.
    what
        Name of the column.
    name
        Name of the recording.

    Raises
    ------
    InputError
        The values are held; the message states the interval and the remedy.
    """
    repeats = _repeats(values[np.isfinite(values)])
    if repeats is None or repeats.coarse or repeats.usual < 2.0:
        return
    # A signal at rest and a clipped one also repeat values, but not as regularly.
    if np.mean(np.abs(repeats.lengths - repeats.usual) <= 1.0) > _REGULAR:
        raise InputError(
            f"{name}: {what}: {HOLDS.format(repeats.usual)}keep the rows at which it changes; for "
            "a ROS bag, give the bag and not its import"
        )
