"""Reports on recordings: tables, pictures and pages of runs, and comparisons with simulations."""
