"""The page that explains the notation of all outputs, and its sections, for who reads these."""

PAGE = "docs/conventions.md"
ANGLES = f"{PAGE}#angles"
WHIRL = f"{PAGE}#whirl-and-we"
MASSES = f"{PAGE}#where-masses-are"
NOTATION = f"Symbols, signs, angles: {PAGE}"
"""Said under tables, pictures and pages that are full of them."""
