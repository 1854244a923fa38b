"""Options that commands share."""

import os
from typing import Annotated

import typer

from ab_sim.errors import InputError

SceneArgument = Annotated[
    str, typer.Argument(help="Name of a scene (see `ab-sim scenes`) or path of a YAML file.")
]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Change a value of the scene, e.g. balls.mass=0.002 or "
        "effects.viscous_drag.coefficient=2, SI or with a unit, 'balls.mass=2 g'; an empty value "
        "removes the key. accuracy.angle=1e-9 [rad] or accuracy.whirl=1e-6 [e] asks for an error "
        "instead of the scene's solver: the cheapest stepper and step measured to deliver it are "
        "taken. Repeatable.",
    ),
]
JsonOption = Annotated[
    str | None,
    typer.Option(metavar="FILE|-", help="Write the result as JSON, or to standard output."),
]
ViewOption = Annotated[
    str,
    typer.Option(
        metavar="none|web|native|URL",
        help="Watch it in Rerun's viewer: in a browser, at the address that is printed; in a "
        "window; or in a viewer that runs already, rerun+http://HOST:PORT/proxy.",
    ),
]
WorkersOption = Annotated[
    int | None,
    typer.Option(
        metavar="N", help="Processes that share the work. Default: as many as processors."
    ),
]


def processes(workers: int | None) -> int:
    """How many processes to use.

    Raises:
        InputError: fewer than one.
    """
    count = len(os.sched_getaffinity(0)) if workers is None else workers
    if count < 1:
        raise InputError(f"--workers {count}: must be at least 1")
    return count
