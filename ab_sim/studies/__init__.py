"""Measure the CPU time of effects and of accuracy, compared with other integrators."""
