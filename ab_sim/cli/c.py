"""`ab-sim c` and `ab-sim urdf`."""

from ab_sim.base.errors import InputError
from ab_sim.base.files import FMU
from ab_sim.base.presentation import Progress
from ab_sim.cli.recording_commands import UrdfOptions
from ab_sim.cli.runner import Command, Outcome
from ab_sim.cli.scene_commands import COptions
from ab_sim.drive.urdf import urdf_of
from ab_sim.export.c_code.fmu import write_fmu
from ab_sim.export.c_code.sources import NAMES, check_output, sources_of, write_sources
from ab_sim.scene import load_scene


def c_command(options: COptions) -> Command:
    """Return the command that writes a scene's drive in C, or as an FMU."""
    out, fmu = options.out, options.fmu
    if out is None and fmu is None:
        raise InputError("nothing to write: name a folder with --out, or an FMU with --fmu")
    scene = load_scene(options.scene, options.change)
    if out is not None:
        check_output(out, list(NAMES), "--out")

    def work(tell: Progress) -> Outcome:
        sources, summary, written = sources_of(scene), [], []
        if fmu is not None:
            fmu_report = write_fmu(sources, fmu, "--fmu")
            binary = fmu_report.binary or "none: there is no C compiler (cc)"
            written.append(fmu)
            summary.append(f"FMU of {len(fmu_report.variables)} variables; binary for {binary}")
        if out is not None:
            written += write_sources(sources, out, "--out")
            summary.append(f"{scene.name} in C: begin with {out / 'README.md'}")
        return Outcome(summary, written=written)

    return Command(work, outputs=[(fmu, FMU, "--fmu")])


def print_urdf(options: UrdfOptions) -> None:
    """Print a scene as a URDF."""
    print(urdf_of(load_scene(options.scene, options.change), options.ros2_control), end="")
