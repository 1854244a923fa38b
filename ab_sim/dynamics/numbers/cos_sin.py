"""Cosine and sine together, by arithmetic alone.

Half of a step's time would go into the C library's. This one has no branch and calls nothing, so
that it inlines, and serves numbers and runs side by side alike.
"""

from typing import Any

from numba.core import types
from numba.extending import overload, register_jitable

from ab_sim.dynamics.dispatch import INLINED
from ab_sim.dynamics.numbers.multiply_add import multiply_add

_QUARTERS = 0.6366197723675814
"""2/pi."""
ROUND = 6755399441055744.0
"""1.5 * 2^52: what is added to it is rounded to a whole number."""
_PI_2A, _PI_2B, _PI_2C = 1.5707963267341256, 6.077100506303966e-11, 2.0222662487959506e-21
"""pi/2 in pieces of 33 bits, whose products with up to 2^20 quarters are exact; with more, what is
left by the first is, and the others are small."""


def cos_sin(x: Any) -> Any:
    """(cos x, sin x), each to within 2^-53 or so of 1 for abs(x) up to 10^9 (in Python up to 10^6).

    Source: fdlibm's k_cos and k_sin (Sun Microsystems, 1993), with its three-piece reduction.
    """
    quarters = multiply_add(x, _QUARTERS, ROUND) - ROUND
    r = multiply_add(quarters, -_PI_2A, x)
    r = multiply_add(quarters, -_PI_2C, multiply_add(quarters, -_PI_2B, r))
    z = r * r
    # In pairs (Estrin), which wait for each other less than Horner's chain.
    zz = z * z
    s = multiply_add(z, 1.58969099521155e-10, -2.5050760253406863e-08)
    s = multiply_add(zz, s, multiply_add(z, 2.7557313707070068e-06, -0.0001984126982985795))
    s = multiply_add(zz, s, multiply_add(z, 0.00833333333332249, -0.16666666666666632))
    s = multiply_add(r * z, s, r)
    c = multiply_add(z, -1.1359647557788195e-11, 2.087572321298175e-09)
    c = multiply_add(zz, c, multiply_add(z, -2.7557314351390663e-07, 2.480158728947673e-05))
    c = multiply_add(zz, c, multiply_add(z, -0.001388888888887411, 0.0416666666666666))
    half = 0.5 * z
    near = 1.0 - half
    c = near + multiply_add(zz, c, (1.0 - near) - half)
    # Turn by the quarters left over, -2 .. 2: their cosine and sine are whole numbers.
    left = quarters - 4.0 * (multiply_add(quarters, 0.25, ROUND) - ROUND)
    turn_c = 1.0 - abs(left)
    turn_s = left * (2.0 - abs(left))
    return c * turn_c - s * turn_s, s * turn_c + c * turn_s


SMALL = 1.0 / 256.0
"""Turns [rad] that ``turned`` makes to rounding."""


@register_jitable(**INLINED)
def turned(c: Any, s: Any, d: Any) -> Any:
    """(cos(x + d), sin(x + d)) from those of x, for abs(d) up to SMALL."""
    dd = d * d
    a = dd * multiply_add(dd, 1.0 / 24.0, -0.5)
    b = d * multiply_add(dd, multiply_add(dd, 1.0 / 120.0, -1.0 / 6.0), 1.0)
    return c + (c * a - s * b), s + (s * a + c * b)


@overload(cos_sin, jit_options=INLINED, strict=False)
def _cos_sin(x):  # type: ignore[no-untyped-def]
    return cos_sin if isinstance(x, types.Number) else None
