"""From a scene to numbers: constants of what moves, the layout of its state, its linear parts."""
