"""`ab-sim c`."""

from pathlib import Path

from ab_sim.c_code.sources import NAMES, sources_of
from ab_sim.c_code.writing import check_output, write_fmu, write_sources
from ab_sim.cli.progress import Tell
from ab_sim.cli.runner import Command, Outcome
from ab_sim.errors import InputError
from ab_sim.output_file import FMU
from ab_sim.scene import load_scene


def c_command(scene_name: str, changes: list[str], out: Path | None, fmu: Path | None) -> Command:
    """Return the command that writes a scene's drive in C, or as an FMU."""
    if out is None and fmu is None:
        raise InputError("nothing to write: name a folder with --out, or an FMU with --fmu")
    scene = load_scene(scene_name, changes)
    if out is not None:
        check_output(out, list(NAMES), "--out")

    def work(tell: Tell) -> Outcome:
        sources, shown, written = sources_of(scene), [], []
        if fmu is not None:
            made = write_fmu(sources, fmu, "--fmu")
            binary = made.binary or "none: there is no C compiler (cc)"
            shown.append(f"FMU of {len(made.variables)} variables; binary for {binary}")
        if out is not None:
            written += write_sources(sources, out, "--out")
            shown.append(f"{scene.name} in C: begin with {out / 'README.md'}")
        return Outcome(shown, written=written)

    return Command(work, outputs=[(fmu, FMU, "--fmu")], aside=True)
