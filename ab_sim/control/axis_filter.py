"""Extended Kalman filter that estimates critical speed and net unbalance from one axis.

Along one axis the deck moves as

    x'' = -K x - D x' + Re[q (w^2 - i al) e^{i psi}]

with K the square of the critical speed, D = damping / mass, q the offset of the mass centre of
rotor and balls on axes that turn with the rotor, psi, w and al the spindle's angle, speed and
acceleration, the angle counted from the axis. The filter is that of Jazwinski (1970), Stochastic
Processes and Filtering Theory, chapter 8. The state is x, x', Re q, Im q, K, D and the sensor's
offset; q, K, D and the offset are random walks. A reading is x + offset, or x'' + offset.

For an accelerometer the state holds X = K x and X' instead, for which the equation has the same
form, with K q in place of q. A reading is then -X - (D/K) X' + Re[...] + offset, which is linear
except for D/K. With separate x and K it would contain a product of two unknowns, and the filter
then converged to wrong critical speeds. A low-pass of the sensor only turns q, which does not
matter.

The functions ``axis_*`` in examples/firmware_prototype/c/adaptive.c do the same operations.
"""

import math

from ab_sim.control import chosen

SIZE = 7
"""Number of states of the filter."""
NUMBERS = SIZE + SIZE * SIZE + 11
"""Number of values in the state of an ``AxisFilter``."""


class AxisFilter:
    """Extended Kalman filter of one axis; the module describes its states and equations.

    Parameters
    ----------
    acceleration : bool
        Whether readings are accelerations; else displacements.
    final_speed : float
        Final speed of the start-up [rad/s]; the critical speed is assumed to be lower.
    noise : float
        Standard deviation of a reading [m or m/s^2]; 0: unknown.
    """

    __slots__ = (
        "_acceleration", "_before", "_count", "_final", "_first", "_last", "_noise", "_rough",
        "_squares", "_sum", "_wild", "covariance", "known", "size", "state", "variance",
    )  # fmt: skip

    def __init__(self, acceleration: bool, final_speed: float, noise: float) -> None:
        self._acceleration, self._final, self._noise = acceleration, final_speed, noise
        stiffness = (chosen.FIRST_RATIO * final_speed) ** 2
        damping = chosen.FIRST_DAMPING * math.sqrt(stiffness)
        self.state = [0.0, 0.0, 0.0, 0.0, stiffness, damping, 0.0]
        self.covariance = [[0.0] * SIZE for _ in range(SIZE)]
        self.covariance[4][4] = (chosen.FIRST_STIFFNESS_DEVIATION * stiffness) ** 2
        self.covariance[5][5] = damping * damping
        self.known = 0.0
        """1 once the axis has an estimate; 0 while readings are collected to estimate noise."""
        self.variance = self.size = 0.0
        """Variance of a reading, from the innovations; and exponentially averaged square of a
        reading without its offset."""
        self._first = self._sum = self._squares = self._rough = self._last = self._before = 0.0
        self._count = self._wild = 0.0

    def restart(self) -> None:
        """Estimate motion and noise again from new readings; keep the estimates of K and D."""
        if self.known == 1.0:
            self.known = self._count = self._wild = 0.0

    def restart_with(self, critical: float, damping: float) -> None:
        """Restart with an uncertain estimate of the suspension, for example that of another axis.

        Parameters
        ----------
        critical : float
            Critical speed [rad/s].
        damping : float
            Damping over mass [1/s].
        """
        self.restart()
        stiffness = critical * critical
        self.state[4], self.state[5] = stiffness, damping
        self.covariance[4][4] = (chosen.DOUBTED_STIFFNESS_DEVIATION * stiffness) ** 2
        self.covariance[5][5] = damping * damping

    def collect(self, reading: float, speed: float) -> None:
        """Collect a reading for the first estimate of the axis.

        After 20 readings, and at a tenth of the final speed, compute the first estimate.

        Parameters
        ----------
        reading : float
            Displacement or acceleration, as the sensor reports it [m or m/s^2].
        speed : float
            Spindle speed [rad/s]. At low speed the unbalance moves the deck too little.
        """
        if self._count == 0.0 or self._count > 400.0:
            self._first, self._sum, self._squares, self._rough = reading, 0.0, 0.0, 0.0
            self._count = 0.0
        change = reading - self._first
        self._sum += change
        self._squares += change * change
        if self._count >= 2.0:
            bend = reading - 2.0 * self._last + self._before
            self._rough += bend * bend
        self._before, self._last = self._last, reading
        self._count += 1.0
        if self._count >= 20.0 and speed >= 0.1 * self._final:
            self._begin(speed)

    def _begin(self, speed: float) -> None:
        """Compute the first estimate from the collected readings at a spindle speed [rad/s]."""
        count, mean = self._count, self._sum / self._count
        spread = math.sqrt(max(self._squares / count - mean * mean, 0.0))
        # Second differences of white noise have 6 times its variance, and the slow motion nearly
        # cancels in them. The given noise may be too small, and the observed one contains spikes.
        noise_estimate = math.sqrt(self._rough / (6.0 * (count - 2.0)))
        if self._noise > 0.0:
            noise_estimate = min(noise_estimate, 10.0 * self._noise)
        noise = max(max(self._noise, noise_estimate), 1e-3 * spread)
        if not noise > 0.0:
            return
        stiffness, damping = self.state[4], self.state[5]
        old = self.covariance
        # Standard deviations of the states before the first update: too large ones cost some
        # readings, too small ones would make the filter ignore readings.
        motion, net, least = spread, spread * stiffness / (speed * speed), noise
        if self._acceleration:
            motion, net, least = net, net / (speed * speed), noise / stiffness
        motion += noise
        net = max(100.0 * least, 4.0 * net)
        motion_rate = motion * (speed + 0.1 * self._final)
        offset = 3.0 * noise + spread
        deviations = (motion, motion_rate, net, net)
        rows = [[0.0] * SIZE for _ in range(SIZE)]
        for i, deviation in enumerate(deviations):
            rows[i][i] = deviation * deviation
        rows[4][4], rows[5][5], rows[6][6] = old[4][4], old[5][5], offset * offset
        self.covariance = rows
        self.state = [0.0, 0.0, 0.0, 0.0, stiffness, damping, self._first + mean]
        self.variance, self.size, self.known = noise * noise, spread * spread, 1.0

    def predict(self, h: float, p0: float, r0: float, p1: float, r1: float) -> None:
        """Predict the state ``h`` seconds ahead.

        Parameters
        ----------
        h : float
            Step [s].
        p0, r0, p1, r1 : float
            Force per mass for a net unbalance q of 1 m (p) and of 1 m times the imaginary unit (r),
            at the beginning (0) and at the end (1) of the step [m/s^2].
        """
        x, v, a, b, K, D, offset = self.state
        u0, u1 = a * p0 + b * r0, a * p1 + b * r1
        k0 = k1 = 0.0
        if self._acceleration:
            k0, k1 = u0, u1
            u0, u1, p0, r0, p1, r1 = u0 * K, u1 * K, p0 * K, r0 * K, p1 * K, r1 * K
        # One step of Heun's method, with the force at both ends: order 2. The covariance P becomes
        # J P J'. Only two rows of the Jacobian J differ from the identity: f and g, polynomials in
        # the state. Writing them out takes a fraction of the time of 7 x 7 products.
        half, square = 0.5 * h, 0.5 * h * h
        start = u0 - K * x - D * v
        x1, v1 = x + h * v + square * start, v + h * start
        end = u1 - K * x1 - D * v1
        # Derivatives of x and v at the end by the state before: f, g; of ``start``: the rest.
        j4 = k0 - x
        f0, f1, f2 = 1.0 - square * K, h - square * D, square * p0
        f3, f4, f5 = square * r0, square * j4, -(square * v)
        hd = h * D
        g0 = half * (hd * K - K * f0 - K)
        g1 = 1.0 + half * (hd * D - K * f1 - D - D)
        g2 = half * (p0 + p1 - K * f2 - hd * p0)
        g3 = half * (r0 + r1 - K * f3 - hd * r0)
        g4 = half * (j4 + k1 - x1 - K * f4 - hd * j4)
        g5 = half * (hd * v - v1 - K * f5 - v)
        P = self.covariance
        row0, row1, row2, row3, row4, row5, row6 = P
        columns = tuple(zip(row0, row1, row2, row3, row4, row5, strict=True))
        X = [
            f0 * c0 + f1 * c1 + f2 * c2 + f3 * c3 + f4 * c4 + f5 * c5
            for c0, c1, c2, c3, c4, c5 in columns
        ]
        V = [
            g0 * c0 + g1 * c1 + g2 * c2 + g3 * c3 + g4 * c4 + g5 * c5
            for c0, c1, c2, c3, c4, c5 in columns
        ]
        X0, X1, X2, X3, X4, X5, X6 = X
        V0, V1, V2, V3, V4, V5, V6 = V
        xx = f0 * X0 + f1 * X1 + f2 * X2 + f3 * X3 + f4 * X4 + f5 * X5
        xv = g0 * X0 + g1 * X1 + g2 * X2 + g3 * X3 + g4 * X4 + g5 * X5
        vv = g0 * V0 + g1 * V1 + g2 * V2 + g3 * V3 + g4 * V4 + g5 * V5
        row0[:] = xx, xv, X2, X3, X4, X5, X6
        row1[:] = xv, vv, V2, V3, V4, V5, V6
        # Process noise of the random walks: q moves as the balls do, in proportion to its size.
        walk = chosen.NET_WALK * chosen.NET_WALK * h * (a * a + b * b)
        walk_K, walk_D = chosen.STIFFNESS_WALK * K, chosen.DAMPING_WALK * D
        row2[0], row2[1], row2[2] = X2, V2, row2[2] + walk
        row3[0], row3[1], row3[3] = X3, V3, row3[3] + walk
        row4[0], row4[1], row4[4] = X4, V4, row4[4] + walk_K * walk_K * h
        row5[0], row5[1], row5[5] = X5, V5, row5[5] + walk_D * walk_D * h
        drift = chosen.OFFSET_WALK * chosen.OFFSET_WALK * self.variance * h
        row6[0], row6[1], row6[6] = X6, V6, row6[6] + drift
        self.state = [x1, v + half * (start + end), a, b, K, D, offset]

    def update(self, reading: float, p: float, r: float) -> None:
        """Update the state with a reading.

        Parameters
        ----------
        reading : float
            Displacement or acceleration, as the sensor reports it [m or m/s^2].
        p, r : float
            Force per mass for a net unbalance q of 1 m (p), and of 1 m times the imaginary unit
            (r) [m/s^2].
        """
        P, state = self.covariance, self.state
        noise = self.variance + chosen.SCALE_ERROR * chosen.SCALE_ERROR * self.size
        x, v, a, b, K, D, offset = state
        if self._acceleration:
            d = D / K
            h4, h5 = d / K * v, -(v / K)
            g = [
                p * c2 + r * c3 + h4 * c4 + h5 * c5 + c6 - c0 - d * c1
                for c0, c1, c2, c3, c4, c5, c6 in P
            ]
            g0, g1, g2, g3, g4, g5, g6 = g
            S = p * g2 + r * g3 + h4 * g4 + h5 * g5 + g6 - g0 - d * g1 + noise
            innovation = reading - (a * p + b * r + offset - x - d * v)
        else:
            g = [row[0] + row[6] for row in P]
            S = g[0] + g[6] + noise
            innovation = reading - (x + offset)
        if not S > 0.0:
            self.restart()
            return
        # With the gain scaled by sqrt(S), the update P - gain gain' keeps P symmetric.
        root = math.sqrt(S)
        gain = [value / root for value in g]
        surprise = innovation / root
        # A reading far from its prediction is a spike: its weight is cut, as in Huber's loss. Many
        # in a row mean that the filter itself is wrong, so it starts again.
        square = surprise * surprise
        self._wild = self._wild + 1.0 if square > chosen.WILD else 0.0
        if self._wild >= chosen.LOST:
            self.restart()
            return
        if square > chosen.WILD:
            surprise *= math.sqrt(chosen.WILD / square)
            square = chosen.WILD
        self.state = state = [s + k * surprise for s, k in zip(state, gain, strict=True)]
        for i, row in enumerate(P):
            k, before = gain[i], row[i]
            row[:] = [c - k * other for c, other in zip(row, gain, strict=True)]
            # Rounding must not make a variance negative.
            row[i] = max(row[i], 1e-6 * before)
        # In a consistent filter ``square`` is 1 on average; the assumed noise is adjusted to that.
        self.variance *= 1.0 + chosen.NOISE_GAIN * (square - 1.0)
        change = reading - state[6]
        self.size += 0.01 * (change * change - self.size)
        # Keep the critical speed within 0.1 to 0.95 of the final speed, and the damping plausible:
        # a few bad readings could otherwise move them so far that the filter does not recover.
        final = self._final
        state[4] = min(max(state[4], 0.01 * final * final), 0.9 * final * final)
        state[5] = min(max(state[5], 0.002 * final), 0.3 * final)
        total = state[0] + state[1] + state[2] + state[3] + state[6] + P[0][0] + P[1][1]
        if not abs(total) < 1e30:
            self._lose()

    def _lose(self) -> None:
        """Forget all estimates, because the state has diverged."""
        fresh = AxisFilter(self._acceleration, self._final, self._noise)
        self.restore(fresh.numbers())

    def numbers(self) -> list[float]:
        """Return the complete state as ``NUMBERS`` values, for ``restore``."""
        state = [self.known, self.variance, self.size, self._first, self._sum, self._squares]
        state += [self._rough, self._last, self._before, self._count]
        state.append(self._wild)
        return [*self.state, *(value for row in self.covariance for value in row), *state]

    def restore(self, numbers: list[float]) -> None:
        """Restore a state that ``numbers`` returned."""
        self.state = numbers[:SIZE]
        for i in range(SIZE):
            self.covariance[i] = numbers[SIZE * (i + 1) : SIZE * (i + 2)]
        self.known, self.variance, self.size, self._first, self._sum, self._squares = numbers[56:62]
        self._rough, self._last, self._before, self._count, self._wild = numbers[62:]
