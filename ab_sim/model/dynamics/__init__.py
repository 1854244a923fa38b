"""Systems from scenes: constants of the bodies, layout of the state, linearised motion."""
