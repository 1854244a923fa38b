"""Errors, names, files, text, colours and worker processes; nothing here depends on a drive."""
