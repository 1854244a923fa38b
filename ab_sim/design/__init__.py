"""Studies of many drives: sweeps over a scene's keys, evaluated by metrics."""
