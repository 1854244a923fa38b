"""Functions that write a drive as C, and as an FMU."""

from pathlib import Path

from ab_sim.base.files import FMU, check_ending, check_writable
from ab_sim.export.c_code import fmu
from ab_sim.export.c_code.sources import sources_of, write_sources
from ab_sim.scene.load import SceneLike, as_scene


def write_c(scene: SceneLike, folder: Path | str) -> list[Path]:
    """Write a scene's drive as self-contained C99: ``ab-sim c --out``.

    Parameters
    ----------
    scene : Scene, str or Path
        Smooth scene with an explicit stepper.
    folder : Path or str
        Folder, created if missing. Files in it by ``ab-sim c`` are replaced.

    Returns
    -------
    list of Path
        Written files: header, source, example, check, CMakeLists.txt, README.md.

    Raises
    ------
    SceneError
        The scene has effects with events (friction, contact, a motor), requests an accuracy or
        another kind of stepper, or has a step that is too long at ``spindle.max_speed``.
    InputError
        The folder cannot be written to, or has another file with such a name.

    Examples
    --------
    >>> import ab_sim
    >>> scene = ab_sim.load_scene("thesis-hold", ["effects.rolling_friction="])
    >>> [file.name for file in ab_sim.write_c(scene, "drive")]
    ['drive.h', 'drive.c', 'main.c', 'drive_check.c', 'CMakeLists.txt', 'README.md']
    """
    return write_sources(sources_of(as_scene(scene)), Path(folder), "folder")


def write_fmu(scene: SceneLike, file: Path | str) -> str | None:
    """Write a scene's drive as an FMU of FMI 3.0, for co-simulation: ``ab-sim c --fmu``.

    Parameters
    ----------
    scene : Scene, str or Path
        Smooth scene with an explicit stepper.
    file : Path or str
        File to write, .fmu; an existing one is replaced. The FMU gets its name.

    Returns
    -------
    str or None
        Platform of the FMU's binary, e.g. x86_64-linux; None if there is no C compiler (``cc``),
        so that the FMU has sources only.

    Raises
    ------
    SceneError
        As in ``write_c``.
    InputError
        The file cannot be written, or the compiler fails.

    Examples
    --------
    >>> import ab_sim
    >>> platform = ab_sim.write_fmu("no-ball", "drive.fmu")
    """
    path = Path(file)
    check_ending(path, FMU, "file")
    check_writable(path, "file")
    return fmu.write_fmu(sources_of(as_scene(scene)), path, "file").binary
