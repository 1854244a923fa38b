"""The balls: on the race, with friction, in rows, in impacts; whatever it is that carries them."""
