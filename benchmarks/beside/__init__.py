"""Our steppers and other people's integrators on one drive: see ../peers.py."""
