"""Which balls can touch, how far apart they are, and what an impact does.

Neighbours i, j in cyclic order keep theta_j - theta_i >= Delta = 2 asin((a_i + a_j) / (2 R)).
A contact force with tangential component lambda pushes i back and j forward; that it also presses
both on the race is left out, as in what this is the reference of.
"""

from itertools import combinations
from typing import NamedTuple

import numpy as np

from .model import Array, Model

REST_RATE = 1e-10
"""rad/s: gaps that change more slowly than this do not change."""
HOP_RATE = 3e-6
"""rad/s: an impact elsewhere that would open a contact more slowly than this leaves it closed."""
TOUCHING = 1e-10
"""rad: gaps smaller than this are none."""


class Chain(NamedTuple):
    """The possible contacts: arrays with one entry for each."""

    behind: Array
    ahead: Array
    closest: Array
    """Delta."""
    turns: Array
    """What unwraps theta_j - theta_i - Delta to the gap: a multiple of 2 pi."""
    directions: Array
    """Rows c of gap' = c q'."""

    @property
    def size(self) -> int:
        """Number of contacts."""
        return len(self.behind)

    def gaps(self, angles: Array) -> Array:
        """Free angle between neighbours [rad], from absolute or relative ball angles."""
        return angles[self.ahead] - angles[self.behind] + self.turns - self.closest

    def rates(self, rates: Array) -> Array:
        """theta_j' - theta_i'."""
        return rates[self.ahead] - rates[self.behind]


def chain_of(model: Model, angles: Array) -> Chain:
    """The contacts of balls that start at ``angles``; none without contact or with one ball."""
    n = model.count
    many = model.p.contact is not None and n > 1
    order = np.argsort(np.mod(angles, 2.0 * np.pi), kind="stable")
    behind, ahead = (order, np.roll(order, -1)) if many else (order[:0], order[:0])
    reach = model.radii[behind] + model.radii[ahead]
    closest = 2.0 * np.arcsin(reach / (2.0 * model.p.race_radius))
    apart = angles[ahead] - angles[behind]
    each = np.arange(len(behind))
    directions = np.zeros((len(each), model.size))
    directions[each, 3 + ahead], directions[each, 3 + behind] = 1.0, -1.0
    turns = np.mod(apart, 2.0 * np.pi) - apart
    chain = Chain(behind, ahead, closest, turns, directions)
    if (chain.gaps(angles) < -TOUCHING).any():
        raise ValueError("balls overlap at the start")
    return chain


def touching(chain: Chain, q: Array, rates: Array) -> Array:
    """Which contacts have neither gap nor approach."""
    still = np.abs(chain.rates(rates[3:])) <= REST_RATE
    return (np.abs(chain.gaps(q[3:])) <= TOUCHING) & still


def impact(model: Model, chain: Chain, hit: int, q: Array, rates: Array) -> Array:
    """q' after the impact of contact ``hit``; M (q'+ - q'-) = c^T Lambda with the full matrix M.

    Newton's law for all contacts that touch, with u = c q' and Lambda complementary:
    u+ >= -e u-,  Lambda >= 0,  Lambda (u+ + e u-) = 0. A prescribed spindle keeps its speed.
    """
    p = model.p
    assert p.contact is not None
    mass = model.kinematics(q, rates).mass
    free = np.array([i for i in range(3 + p.count) if i != 2 or p.motor is not None])
    rows = chain.directions
    resting = touching(chain, q, rates)
    resting[hit] = True
    active = np.flatnonzero(resting)
    before = rows[active] @ rates
    fast = p.race_radius * np.abs(before) >= p.contact.rest_speed
    target = -p.contact.restitution * fast * before
    mobility = np.zeros((3 + p.count, len(active)))
    mobility[free] = np.linalg.solve(mass[np.ix_(free, free)], rows[active][:, free].T)
    response = rows[active] @ mobility

    def impulses(chosen: list[int]) -> Array:
        found = np.zeros(len(active))
        block = response[np.ix_(chosen, chosen)]
        found[chosen] = np.linalg.solve(block, (target - before)[chosen])
        return found

    for size in range(len(active), 0, -1):
        for chosen in map(list, combinations(range(len(active)), size)):
            impulse = impulses(chosen)
            excess = before + response @ impulse - target
            if (impulse >= 0.0).all() and (excess >= -REST_RATE).all():
                barely = [i for i in range(len(active)) if excess[i] < HOP_RATE and not fast[i]]
                return rates + mobility @ impulses(sorted({*chosen, *barely}))
    raise RuntimeError("no impulse satisfies Newton's law")
