"""Errors, names, files, text, colours and workers, which know no drive."""
