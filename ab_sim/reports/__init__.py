"""What recordings come to: tables, pictures and pages of runs, and runs beside a simulation."""
