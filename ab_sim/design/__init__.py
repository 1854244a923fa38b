"""Decisions over many drives: sweeps over a scene's keys, judged by merits."""
