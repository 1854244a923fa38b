"""What an accuracy costs: how the scene's own solver is chosen where it asks for an accuracy."""

from ab_sim.accuracy.price import SAFETY, Price, share_of
from ab_sim.accuracy.search import cheapest
from ab_sim.accuracy.trials import Run, Timed

__all__ = ["SAFETY", "Price", "Run", "Timed", "cheapest", "share_of"]
