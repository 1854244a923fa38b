"""The numbers of the adaptive start-up; how they were found: docs/adaptive.md.

Times are in units of ``UNIT / final_speed`` seconds, so that a drive twice as fast is decided about
in half the time. Net unbalances q are relative to the largest that was seen, the *scale*. A *ratio*
is speed over critical speed.
"""

UNIT = 200.0
"""rad; one unit of time is 1 s for a final speed of 200 rad/s."""

# --- the estimator
FIRST_RATIO = 0.5
FIRST_STIFFNESS_DEVIATION = 0.6
"""Critical speed over final speed, to begin with, and relative deviation of K."""
FIRST_DAMPING = 0.03
"""D over critical speed, to begin with, and its deviation."""
NET_WALK = 0.5
STIFFNESS_WALK = 0.001
DAMPING_WALK = 0.02
"""Relative random walk of q, K and D, per square root of a second."""
OFFSET_WALK = 10.0
"""Random walk of the sensor's offset, in deviations of a reading per square root of a second."""
SCALE_ERROR = 0.002
"""Error of a reading that grows with the reading."""
NOISE_GAIN = 0.002
"""How fast the variance of a reading follows the innovations, per sample."""
WILD = 9.0
"""Square of the innovation over its deviation, beyond which a reading counts less."""
LOST = 20
"""Such readings in a row show that the filter has lost the motion, and finds it anew."""
LONGEST_GAP = 0.25
"""s between samples, beyond which the motion is found anew."""
STEP_ANGLE = 0.3
"""rad: the final speed times the longest step of the prediction."""

# --- what is made of its beliefs
FAST = 0.075
SLOW = 0.38
"""Time constants of two averages of |q|: their difference is its rate of change."""
CERTAIN = 0.25
"""Deviation over magnitude, below which a net unbalance may become the scale."""
KNOWN_CRITICAL = 0.025
"""Relative deviation of the critical speed, below which a dwell is aimed at."""

# --- dwells
FIRST_WHIRL = 16.0
LATER_WHIRL = 20.0
"""Largest whirl that is aimed at, over the scale; in the first dwell, in later ones."""
LARGEST_LAG = 1.0
"""Tangent of the whirl's phase lag behind 180 degrees: nearer to the critical speed it drives balls
astray."""
LAG_STEP = 0.25
"""Relative change of that from one dwell to another."""
LEAST_DISTANCE = 0.06
MOST_DISTANCE = 0.3
"""Of ratio^2 from 1; the first for a critical speed of half the final speed."""
RISING = 0.09
"""Rate of |q| beyond which balls are driven astray: the speed goes up ..."""
UP = 0.55
DOWN = 0.1
"""... by so much ratio per time, and down again while it falls."""
AWAY = 0.3
"""Ratio by which it may have gone up; then the dwell is over."""
FALLING = 0.5
"""Rate with which |q| must fall, or it counts as stagnant; for a critical speed of half the final
speed."""
STAGNANT = 0.25
STAGNANT_PER_NET = 5.5
"""How long it may be: the larger q, the longer. Balls on opposite sides stay there for a while."""
NEARER = 0.7
"""While it is stagnant it goes nearer, at the end by this share of the least distance: a larger
whirl frees balls that friction holds."""
LONGEST_DWELL = 10.0
SMALL = 0.125
"""A dwell is over when |q| is that small."""
LATE = 1.5
"""s after ``patience``, when any dwell is over."""
LEAVING = 0.9
"""Away from the critical speed by at most this times (distance)^2: a change that slow leaves no
free whirl behind, which would take seconds to die away."""

# --- judging
SETTLE = 0.35
"""At the final speed before it is judged; twice that before it is called balanced."""
BALANCED = 0.15
"""|q| that is called balanced."""
ACCEPTED = 0.25
GAIN = 0.85
"""|q| that is accepted after a dwell that has left more than this share of it."""
WAIT = 8.0
"""It waits at the final speed if |q| will be balanced by then."""
UNSURE = 0.5
"""Deviation over magnitude of q, beyond which nothing is known."""
CIRCULATING = 0.7
"""Magnitude of the average q over the average magnitude, below which balls circulate."""

# --- what ends it
FIRST_SAMPLES = 5.0
"""s that it waits for the first samples."""
BACK = 0.1
"""s by which time may go back; such samples are passed over."""
REPEATS = 5
REPEATED = 0.3
"""So many equal readings in a row count, and so much time of them is too much."""
MEAN = 0.25
DRIFTED = 2.0
"""Time constant of a reading's mean; so many times the largest distance of a reading from it, it
may go away from where it began."""
CONTRADICTING = 0.5
"""rad by which angle and speed may contradict each other from one sample to the next."""
AGREEING = 0.3
"""How alike two axes must see q: 2 Re(q1 q2*) / (|q1|^2 + |q2|^2)."""
AXES_AVERAGE = 0.3
DOUBT = 2.0
"""Time constant of that; time within which they must contradict each other a second time, after
their filters have begun anew."""
DOUBTED_STIFFNESS_DEVIATION = 0.1
"""Relative deviation of K that they begin anew with."""
LEAD = 0.15
"""Of the final speed: so far the command goes ahead of the spindle."""
NOT_FOLLOWING = 3.0
"""Time that the spindle may stand off the command without coming nearer to it."""
