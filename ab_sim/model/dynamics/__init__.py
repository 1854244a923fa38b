"""Numbers from scenes: constants of the bodies, layout of the state, linear parts."""
