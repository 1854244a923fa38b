"""Table 1, what the report leaves out, and where it slips."""

from pathlib import Path

from ab_sim.analysis.recovery import kept_recovery
from ab_sim.scene.load import changed_scene
from gallery.page import Cell, PageSection, Table
from gallery.relative_stability.cases import PRINTED_MASSES, Tell, cases


def parameter_section(folder: Path, tell: Tell) -> PageSection:
    """The three cases as scenes, with the printed masses beside the exact ones."""
    tell("Table 1", 0, 1)
    rows: list[tuple[Cell, ...]] = []
    for case, printed in zip(cases(), PRINTED_MASSES, strict=True):
        scene = case.scene
        rounded = changed_scene(scene, {"balls.mass": printed}, "printed mass")
        for mass, made in ((scene.balls.masses[0], scene), (printed, rounded)):
            found = kept_recovery(made)
            ratio = made.balls.total_mass * made.race.radius
            ratio /= made.eccentric_mass * made.rotor.eccentricity
            ours = found.lambda_max, found.settling_time, 1e3 * found.maximum_amplitude
            rows.append((f"{case.number}", 1e3 * mass, ratio, *ours))
    columns = (
        "case", "ball mass [g]", "2 m R / (M2 ε)", "lambda_Rmax [1/s]", "settling time [s]",
        "maximum amplitude [mm]",
    )  # fmt: skip
    table = Table("The balls' masses, exact and as printed", columns, tuple(rows), on_page=False)
    text = (
        "Scenes `nsc-case-1`, `nsc-case-2` and `nsc-case-3`: M1 = 200 g, M2 = 16 g, ε = 0.625 "
        "mm, R = 16.5 mm, k = 8000 N/m, c = 25 N s/m, c_b = 0.2 N s/m; no ball spin, friction "
        "or collisions.",
        "What the report leaves out, and what is taken here:",
        "- the balls' masses are exactly 0.9, 1.0 and 1.1 times M2 ε / (2 R); Table 1 has them "
        "rounded, and case 2 is then not degenerate;\n"
        "- where the balls start: near the resting state at 1000 rad/s, in cases 1 and 2 both at "
        "one angle (see the last section);\n"
        "- the drags over which the composite index has its means: 0.1 to 0.5 N s/m in steps of "
        "0.1;\n"
        "- the method: ours is an eighth-order Runge-Kutta method with steps of 0.5 ms.",
        "Where it slips:",
        "- (7) ends in M2 ε ω'^2, which must be M2 ε ω^2;\n"
        "- the arctangents of (16), (19) and (22) are those of two arguments (atan2);\n"
        "- (25) holds on [t_b, t_b + t_r] only;\n"
        "- Table 1's ω_n is that of case 2; figure 2's landmarks are by each case's own.",
    )
    return PageSection("Parameters: Table 1", text, (table,))
