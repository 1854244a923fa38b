"""Maps: what is stable, over two parameters of a scene."""
