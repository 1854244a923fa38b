"""The equations and a drive in other forms: printed formulas, C99, an FMU."""
