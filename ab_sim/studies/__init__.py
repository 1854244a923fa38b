"""What effects and accuracy cost, beside other people's integrators; and basins of start angles."""
