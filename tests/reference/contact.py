"""Contacts of balls: possible pairs, gaps, and impacts.

Neighbours i, j in cyclic order on a race keep their distance along the race,

    (s_j - s_i) / R >= Delta = 2 asin((a_i + a_j) / (2 R)),    s_j - s_i = integral of |X'(theta)|

from theta_i to theta_j, by quadrature; on a circle theta_j - theta_i >= Delta. A contact force
lambda along the race pushes i back and j forward. Its normal component, which presses both balls on
the race, is left out, as in the model that this is the reference for.
"""

from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.polynomial.legendre import leggauss

from .plant import Array, Plant

REST_RATE = 1e-10
"""Rate of a gap below which the gap counts as constant [rad/s]."""
HOP_RATE = 3e-6
"""Rate below which a contact stays closed despite an impact elsewhere [rad/s]."""
TOUCHING = 1e-10
"""Gap below which balls touch [rad]."""
NODES, WEIGHTS = leggauss(28)
"""Nodes and weights of Gauss' quadrature, enough for the length of a whole turn to rounding."""


class Chain(NamedTuple):
    """Possible contacts, as arrays with one entry for each. Gaps are lengths over R."""

    plant: Plant
    behind: Array
    ahead: Array
    closest: Array
    """Least distances Delta [rad]."""
    turns: Array
    """Multiples of 2 pi that unwrap theta_j - theta_i [rad]."""

    @property
    def size(self) -> int:
        """Return the number of contacts."""
        return len(self.behind)

    @property
    def radius(self) -> Array:
        """Return the race radius R of each contact [m]."""
        return self.plant.curve.radius[self.behind]

    def gaps(self, theta: Array) -> Array:
        """Return the gaps from ball angles relative to the spindle [rad]."""
        begin, turn = theta[self.behind], theta[self.ahead] - theta[self.behind] + self.turns
        curve = self.plant.curve.of(self.behind)
        _, _, path, _ = curve.at(begin[:, None] + turn[:, None] * 0.5 * (NODES + 1.0))
        return 0.5 * turn * (path @ WEIGHTS) / self.radius - self.closest

    def directions(self, q: Array) -> Array:
        """Return the rows c of gap' = c q': s_j' - s_i' with s' = g (psi_i' - psi')."""
        plant, psi = self.plant, self.plant.psi
        found = np.zeros((self.size, plant.size))
        if self.size == 0:
            return found
        _, _, path, _ = plant.curve.at(plant.theta(q))
        each, scale = np.arange(self.size), path / plant.curve.radius
        found[each, psi + 1 + self.ahead] = scale[self.ahead]
        found[each, psi + 1 + self.behind] = -scale[self.behind]
        found[:, psi] = scale[self.behind] - scale[self.ahead]
        return found

    def bias(self, q: Array, rates: Array) -> Array:
        """Return the part of gap'' in addition to c q''."""
        plant = self.plant
        if self.size == 0:
            return np.zeros(0)
        _, _, _, dpath = plant.curve.at(plant.theta(q))
        bend = dpath * plant.theta(rates) ** 2 / plant.curve.radius
        return bend[self.ahead] - bend[self.behind]

    def rates(self, q: Array, rates: Array) -> Array:
        """Return the rates of the gaps [rad/s]."""
        return self.directions(q) @ rates


def chain_of(plant: Plant, angles: Array) -> Chain:
    """Return the contacts of balls that start at ``angles``; none if balls cannot touch."""
    behind, ahead = np.zeros((2, 0), int)
    for race in plant.races:
        if plant.p.contact is not None and len(race) > 1:
            order = race[np.argsort(np.mod(angles[race], 2.0 * np.pi), kind="stable")]
            behind, ahead = np.append(behind, order), np.append(ahead, np.roll(order, -1))
    reach = plant.radii[behind] + plant.radii[ahead]
    closest = 2.0 * np.arcsin(reach / (2.0 * plant.curve.radius[behind]))
    apart = angles[ahead] - angles[behind]
    turns = np.mod(apart, 2.0 * np.pi) - apart
    chain = Chain(plant, behind, ahead, closest, turns)
    if (chain.gaps(angles) < -TOUCHING).any():
        raise ValueError("balls overlap at the start")
    return chain


def touching(chain: Chain, q: Array, rates: Array) -> Array:
    """Return a mask of contacts with neither gap nor approach."""
    still = np.abs(chain.rates(q, rates)) <= REST_RATE
    return (np.abs(chain.gaps(chain.plant.theta(q))) <= TOUCHING) & still


def impact(plant: Plant, chain: Chain, hit: int, q: Array, rates: Array) -> Array:
    """Return q' after the impact of contact ``hit``; M (q'+ - q'-) = c^T Lambda, full matrix M.

    Newton's law for all contacts that touch, with u = c q' and Lambda complementary:
    u+ >= -e u-,  Lambda >= 0,  Lambda (u+ + e u-) = 0. A prescribed spindle keeps its speed.
    """
    p = plant.p
    assert p.contact is not None
    mass = plant.system(q, rates).mass
    free = np.array([i for i in range(plant.size) if i != plant.psi or p.motor is not None])
    rows = chain.directions(q)
    resting = touching(chain, q, rates)
    resting[hit] = True
    active = np.flatnonzero(resting)
    before = rows[active] @ rates
    fast = chain.radius[active] * np.abs(before) >= p.contact.rest_speed
    target = -p.contact.restitution * fast * before
    mobility = np.zeros((plant.size, len(active)))
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
