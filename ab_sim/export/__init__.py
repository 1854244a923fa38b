"""Export of the equations as printed formulas, and of a drive as C99 or as an FMU."""
