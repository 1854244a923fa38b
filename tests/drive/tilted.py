"""Changes to the scene `feeding-deck`, for tests of how a deck is turned."""

TILTED = [
    "rotor.height=0.004",
    "race.height=[0.006, -0.003]",
    "balls.race=[0, 1]",
    "start.deck.tilt=[0.1, -0.2, 0.3]",
    "solver.step=0.0001",
]
"""Disc and balls above and below the mounts; the deck starts far from level."""
