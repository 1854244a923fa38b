"""The package's steppers and other integrators on one drive: see ../peers.py."""
