"""Constants of the adaptive start-up; docs/adaptive.md describes how they were chosen.

Times are in units of ``UNIT / final_speed`` seconds, so that a drive twice as fast has half the
time for decisions. Net unbalances q are relative to the largest one so far, the *scale*. A *ratio*
is speed over critical speed.
"""

UNIT = 200.0
"""Final speed times the unit of time [rad]: the unit is 1 s for a final speed of 200 rad/s."""

# --- the estimator
FIRST_RATIO = 0.5
FIRST_STIFFNESS_DEVIATION = 0.6
"""Initial critical speed over final speed, and relative standard deviation of the stiffness K."""
FIRST_DAMPING = 0.03
"""Initial damping D, and its standard deviation, as fractions of the initial critical speed."""
NET_WALK = 0.5
STIFFNESS_WALK = 0.001
DAMPING_WALK = 0.02
"""Relative random walk of q, K and D, per square root of a second."""
OFFSET_WALK = 10.0
"""Random walk of the sensor's offset, in deviations of a reading per square root of a second."""
SCALE_ERROR = 0.002
"""Part of a reading's error that is proportional to the reading."""
NOISE_GAIN = 0.002
"""Gain per sample with which the estimated variance of a reading follows the innovations."""
WILD = 9.0
"""Square of (innovation / its standard deviation) beyond which a reading's weight is reduced."""
LOST = 20
"""Number of readings beyond ``WILD`` in a row after which the motion is estimated again."""
LONGEST_GAP = 0.25
"""Time between samples beyond which the motion is estimated again [s]."""
STEP_ANGLE = 0.3
"""Final speed times the longest step of the prediction [rad]."""

# --- decisions from the estimates
FAST = 0.075
SLOW = 0.38
"""Time constants of two averages of |q|, whose difference gives the rate of change."""
CERTAIN = 0.25
"""Deviation over magnitude below which a net unbalance may become the scale."""
KNOWN_CRITICAL = 0.025
"""Relative deviation of the critical speed below which a dwell is planned."""

# --- dwells
FIRST_WHIRL = 16.0
LATER_WHIRL = 20.0
"""Largest target whirl over the scale, in the first dwell and in later ones."""
LARGEST_LAG = 1.0
"""Largest tangent of the deviation of the whirl's phase from 180 degrees.

It limits how near a dwell is to the critical speed: nearer, the whirl drives balls in the wrong
direction.
"""
LAG_STEP = 0.25
"""Relative change of ``LARGEST_LAG`` from one dwell to another."""
LEAST_DISTANCE = 0.06
MOST_DISTANCE = 0.3
"""Least and largest distance of ratio^2 from 1; the least for a critical speed of half the final
speed."""
RISING = 0.09
"""Rate of rise of |q| beyond which balls are driven in the wrong direction."""
UP = 0.55
DOWN = 0.1
"""Rise of the ratio per time beyond ``RISING``, and fall of the ratio back per time otherwise."""
AWAY = 0.3
"""Rise of the ratio by ``UP`` at which the dwell ends."""
FALLING = 0.5
"""Rate at which |q| must fall, or a dwell counts as stagnant; for a critical speed of half the
final speed."""
STAGNANT = 0.25
STAGNANT_PER_NET = 5.5
"""Longest stagnation, which grows with |q|: balls on opposite sides stay there for a while."""
NEARER = 0.7
"""Share of the least distance by which a stagnant dwell finally approaches the critical speed: a
larger whirl frees balls that friction holds."""
LONGEST_DWELL = 10.0
SMALL = 0.125
"""Duration that ends a dwell, and value of |q| below which a dwell ends earlier."""
LATE = 1.5
"""Time after ``patience`` at which any dwell ends [s]."""
LEAVING = 0.9
"""Largest ratio per time, over (distance)^2, with which the speed leaves a dwell: such a slow
change excites no free whirl, which would take seconds to decay."""

# --- judging
SETTLE = 0.35
"""Time at the final speed before q is judged; balance is reported only after twice that time."""
BALANCED = 0.15
"""Largest |q| that counts as balanced."""
ACCEPTED = 0.25
GAIN = 0.85
"""Share of |q| left by a dwell above which |q| is accepted."""
WAIT = 8.0
"""Time within which |q| must be predicted to be balanced for a wait at the final speed."""
UNSURE = 0.5
"""Deviation over magnitude of q beyond which q counts as unknown."""
CIRCULATING = 0.7
"""Magnitude of the average q over the average magnitude below which balls circulate."""

# --- aborts
FIRST_SAMPLES = 5.0
"""Time to wait for the first samples [s]."""
BACK = 0.1
"""Time by which samples may go back [s]; such samples are ignored."""
REPEATS = 5
REPEATED = 0.3
"""Number of equal readings in a row that count as repeated, and total time of repetition at which
the start-up is aborted."""
MEAN = 0.25
DRIFTED = 2.0
"""Time constant of the readings' mean, and largest drift of that mean in multiples of the largest
deviation of a reading from the mean."""
CONTRADICTING = 0.5
"""Largest contradiction of angle and speed from one sample to the next [rad]."""
AGREEING = 0.3
"""Least agreement of two axes on q: 2 Re(q1 q2*) / (|q1|^2 + |q2|^2)."""
AXES_AVERAGE = 0.3
DOUBT = 2.0
"""Time constant of that agreement, and time within which a second contradiction counts, after the
filters have restarted."""
DOUBTED_STIFFNESS_DEVIATION = 0.1
"""Relative deviation of K with which the filters restart."""
LEAD = 0.15
"""Largest lead of the command over the spindle, relative to the final speed."""
NOT_FOLLOWING = 3.0
"""Time for which the spindle may be off the commanded speed without approaching that speed."""
