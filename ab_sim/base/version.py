"""Version of the package; in the lowest room, so that no module imports ``ab_sim`` for it."""

__version__ = "0.1.0"
