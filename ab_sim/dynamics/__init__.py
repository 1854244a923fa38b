"""The equations of motion: the planar model, its effects, and their assembly into a kernel."""
