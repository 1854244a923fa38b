"""Table of contents of ``ab-sim --help``: headings, and the commands under each, in order."""

CONTENTS: dict[str, tuple[str, ...]] = {
    "Run and watch": ("demo", "run", "live", "view"),
    "Write a scene": ("scenes", "check", "keys", "effects", "sensors", "merits", "schema"),
    "Choose a design": ("size", "sweep", "tune", "robust", "sensitivity"),
    "Stability and vibration": ("modes", "equilibria", "stability", "floquet", "recovery", "paper"),
    "Accuracy and what it costs": ("accuracy", "cost"),
    "Recordings and measurements": ("report", "compare", "identify", "export", "state"),
    "ROS nodes and bags": ("node", "import", "replay", "mend", "urdf"),
    "Other tools": ("c",),
}
