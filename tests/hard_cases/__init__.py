"""Scenes at the limits of a simulator, one file for each family."""
