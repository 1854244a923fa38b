"""From equations to steps: compiled code, events, steppers, one run or eight side by side."""
