"""Cosine and sine by arithmetic alone, bitwise the same on every machine.

The formula takes floats and expressions, and is in the subset of Python that
``ab_sim.engine.compiling`` translates. Source: fdlibm's k_cos and k_sin (Sun Microsystems, 1993),
with its three-piece reduction. The polynomials are evaluated in pairs (Estrin's scheme), whose
operations depend less on each other than those of Horner's.
"""

from ab_sim.tracing.functions import fma

QUARTERS = 0.6366197723675814
"""2/pi, the number of quarter turns per radian."""
ROUND = 6755399441055744.0
"""1.5 * 2^52; adding and subtracting it rounds a number to the nearest integer."""
PI_2A, PI_2B, PI_2C = 1.5707963267341256, 6.077100506303966e-11, 2.0222662487959506e-21
"""pi/2 in pieces of 33 bits, whose products with up to 2^20 quarter turns are exact. With more, the
remainder after the first piece is still exact, and the other pieces are small."""


def cos_sin(x: float) -> tuple[float, float]:
    """Return (cos x, sin x), with an absolute error of about 2^-53 for abs(x) up to 10^9.

    The code has no branches, so it can run in lanes.
    """
    quarters = fma(x, QUARTERS, ROUND) - ROUND
    # Cody and Waite reduction: r is x less the nearest multiple of pi/2, so abs(r) <= pi/4.
    r = fma(quarters, -PI_2A, x)
    r = fma(quarters, -PI_2C, fma(quarters, -PI_2B, r))
    z = r * r
    zz = z * z
    s = fma(z, 1.58969099521155e-10, -2.5050760253406863e-08)
    s = fma(zz, s, fma(z, 2.7557313707070068e-06, -0.0001984126982985795))
    s = fma(zz, s, fma(z, 0.00833333333332249, -0.16666666666666632))
    s = fma(r * z, s, r)
    c = fma(z, -1.1359647557788195e-11, 2.087572321298175e-09)
    c = fma(zz, c, fma(z, -2.7557314351390663e-07, 2.480158728947673e-05))
    c = fma(zz, c, fma(z, -0.001388888888887411, 0.0416666666666666))
    half = 0.5 * z
    near = 1.0 - half
    c = near + fma(zz, c, (1.0 - near) - half)
    # Rotate by the number of quarter turns modulo 4, from -2 to 2: cosine and sine of that
    # rotation are -1, 0 or 1, and (1 - |n|, n (2 - |n|)) gives them without a branch.
    remainder = fma(-(fma(quarters, 0.25, ROUND) - ROUND), 4.0, quarters)
    turn_c = 1.0 - abs(remainder)
    turn_s = remainder * (2.0 - abs(remainder))
    return fma(c, turn_c, -(s * turn_s)), fma(s, turn_c, c * turn_s)
