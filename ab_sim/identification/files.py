"""Files of an identification, and their conversion to recordings."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from ab_sim.base.errors import InputError, nearest, short
from ab_sim.identification.inputs import check_names, measured_of
from ab_sim.identification.mapping import Mapping as ColumnMapping
from ab_sim.identification.mapping import number_of, read_mapping_file
from ab_sim.identification.measured import NUISANCES, Measured
from ab_sim.scene.model import Scene

MOST_MASS = 1e3
"""Upper limit of a trial mass [kg]."""


class Files(NamedTuple):
    """Files of recordings."""

    recordings: Sequence[Path]
    without_balls: Sequence[Path] = ()
    """Further recordings, made without balls."""
    hold_out: Sequence[Path] = ()
    """Recordings that are predicted but not fitted."""
    maps: Sequence[Path] = ()
    """Mapping files: one for all, one per recording in the order given, or none."""
    signal: str | None = None
    """Name of the signal; see ``usual_mapping``."""
    free: Sequence[str] = ()
    """Names in ``NUISANCES`` that are fitted for each recording."""
    trial_masses: Mapping[str, float] = {}
    """Mass clamped to the deck [kg], by the recording's name without ending."""


def read_files(files: Files, scene: Scene) -> tuple[list[Measured], list[Measured]]:
    """Read all recordings; return those for the fit, and those held out.

    Args:
        files: recordings, their mappings and further settings.
        scene: scene of the drive.

    Raises:
        InputError: a recording cannot be used; the message states the reason and the remedy.
        RecordingError: a recording cannot be read.
    """
    for what in files.free:
        if what not in NUISANCES:
            raise InputError(
                f"free {what}: must be some of {', '.join(NUISANCES)}{nearest(what, NUISANCES)}"
            )
    paths = [*files.recordings, *files.without_balls, *files.hold_out]
    for path in paths:
        if paths.count(path) > 1:
            raise InputError(f"{path}: is given twice; give each recording once")
    mappings = _mappings(files, paths)
    bare = len(files.recordings)
    outside = bare + len(files.without_balls)
    recordings = []
    for k, (path, mapping) in enumerate(zip(paths, mappings, strict=True)):
        balls = False if bare <= k < outside else None
        measured = measured_of(path, scene, mapping, files.signal, balls)
        free = tuple(dict.fromkeys((*measured.free, *files.free)))
        mass = files.trial_masses.get(measured.name, measured.trial_mass)
        if not 0.0 <= mass < MOST_MASS:
            raise InputError(
                f"{measured.name}: trial mass = {mass} kg: must be at least 0, below {MOST_MASS:g}"
            )
        recordings.append(replace(measured, free=free, trial_mass=mass))
    check_names(recordings)
    names = [recording.name for recording in recordings]
    for name in files.trial_masses:
        if name not in names:
            raise InputError(
                f"trial mass {name}: there is no such recording{nearest(name, names)}; there are "
                + ", ".join(names)
            )
    return recordings[:outside], recordings[outside:]


def _mappings(files: Files, paths: Sequence[Path]) -> list[ColumnMapping | None]:
    """Return the mapping of each file; None for recordings and bags, whose columns are known."""
    if len(files.maps) not in (0, 1, len(paths)):
        raise InputError(
            f"--map: {len(files.maps)} mappings for {len(paths)} recordings; give one for all, or "
            "one for each"
        )
    read = [read_mapping_file(path) for path in files.maps]
    if not read:
        return [None] * len(paths)
    mappings: list[ColumnMapping | None] = list(
        read if len(read) == len(paths) else read * len(paths)
    )
    return [
        mapping if path.suffix.lower() in (".csv", ".parquet") else None
        for path, mapping in zip(paths, mappings, strict=True)
    ]


def trial_masses_of(texts: Sequence[str]) -> dict[str, float]:
    """Parse ``NAME=MASS`` into masses [kg] by the recording's name without ending.

    Raises:
        InputError: the text has another form.
    """
    masses = {}
    for text in texts:
        name, equals, mass = (part.strip() for part in text.partition("="))
        if not (name and equals and mass):
            raise InputError(f"--trial-mass {short(text)}: must be NAME=MASS, e.g. 'run-2=5 g'")
        masses[Path(name).stem] = number_of(mass, "kg", f"--trial-mass {short(text)}")
    return masses
