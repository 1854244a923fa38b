"""From equations to steps: compiled code, events, and steppers for one run or eight in lanes."""
