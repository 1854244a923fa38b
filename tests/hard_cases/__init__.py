"""Scenes at the edges: what breaks a naive simulator, family by family."""
