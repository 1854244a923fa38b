"""Steppers, one file each; ``registry`` imports all files in this folder."""
