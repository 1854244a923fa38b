"""`python -m ab_sim` is `ab-sim`."""

from ab_sim.cli import main

main()
