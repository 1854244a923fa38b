"""Deck models, from scenes: one file each, found here by ``dynamics.registry``.

It says how a deck model's constants and start follow from a scene, and what is known of its motion
beforehand, and registers both under a name.
"""
