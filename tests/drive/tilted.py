"""Changes of the scene `feeding-deck` for tests of the deck's orientation."""

TILTED = [
    "rotor.height=0.004",
    "race.height=[0.006, -0.003]",
    "balls.race=[0, 1]",
    "start.deck.tilt=[0.1, -0.2, 0.3]",
    "solver.step=0.0001",
]
"""Disc and balls above and below the mounts, and a deck that starts far from level."""
