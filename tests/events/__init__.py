"""Events in ordinary Python: the same functions that are translated, on emitted equations."""
