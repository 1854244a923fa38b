"""Stability maps over two parameters of a scene."""
