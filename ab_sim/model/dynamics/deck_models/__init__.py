"""Deck models from scenes: one file each, imported by ``dynamics.registry``.

Each file defines how a deck model's constants and start follow from a scene, and the known parts of
its motion, and registers both under a name.
"""
