"""A checked scene as the numbers of a system, every formula once, and the spindle's speed."""
