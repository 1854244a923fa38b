"""Systems from checked scenes, the equations of motion, and the spindle's speed over time."""
