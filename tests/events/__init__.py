"""Tests of events in plain Python: the functions that are compiled, with emitted equations."""
