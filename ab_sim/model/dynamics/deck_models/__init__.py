"""Deck models from scenes: one file each, imported by ``dynamics.registry``.

Each file registers a deck model under a name, with functions that derive its constants, its initial
state and its linear motion from a scene.
"""
