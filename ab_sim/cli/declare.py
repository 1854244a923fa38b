"""Declare a command as a class: its fields are the options, its docstring is the help."""

import copy
import importlib
import inspect
import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, NamedTuple, TypeVar, get_args, get_type_hints

import typer
from typer import Argument, Option

Options = TypeVar("Options", bound=type[tuple[Any, ...]])


class Described(NamedTuple):
    """Description of an option: ``FIELD [--NAME] [METAVAR]``, and below it the help, indented."""

    names: list[str]
    """Name of the option, if it differs from the field's name; empty otherwise."""
    metavar: str | None
    """Name of the option's value in the help; None: the name of its type."""
    help: str
    """Meaning of the option."""


class Heading(typer.Typer):
    """Commands under one heading of ``ab-sim --help``."""

    def __init__(self, heading: str, **settings: Any) -> None:
        super().__init__(**settings)
        self.heading = heading
        self.works: list[str] = []
        """Functions of the commands, each as ``module:function``."""

    def declare(self, work: str, **settings: Any) -> Callable[[Options], Options]:
        """Return a decorator that registers a NamedTuple ``NameOptions`` as the command ``name``.

        Each field is an option, or an argument if its type is an ``Argument``. Its help is in the
        section ``Parameters`` of the docstring; shared types, as ``SceneName``, have their own
        help. A field ``scene`` names a scene to be read; ``json`` and ``plot`` are files of a
        ``Command``.

        Parameters
        ----------
        work
            ``module:function``, imported on the call, because most modules take long to import. The
            function takes the options. It prints its result, or returns a ``Command`` to run.
        settings
            Settings of typer's ``command``.
        """

        def register(options: Options) -> Options:
            def call(**values: Any) -> None:
                if (scene := values.get("scene")) is not None:
                    from ab_sim.base.yaml_files import find_scene

                    find_scene(scene)  # refuses a missing scene before slow imports
                module, _, function = work.partition(":")
                command = getattr(importlib.import_module(module), function)(options(**values))
                if command is not None:
                    command.run(values.get("json"), values.get("plot"))

            call.__doc__, descriptions = described(inspect.cleandoc(options.__doc__ or ""))
            parameters = list(_parameters(options, descriptions))
            assert not descriptions, f"{options.__name__} has no field {', '.join(descriptions)}"
            set_signature(call, parameters)
            self.works.append(work)
            name = options.__name__.removesuffix("Options").lower()
            self.command(name, rich_help_panel=self.heading, **settings)(call)
            return options

        return register


def described(text: str) -> tuple[str, dict[str, Described]]:
    """Split the docstring of an options class.

    Returns
    -------
    tuple[str, dict[str, Described]]
        Help of the command, and the descriptions in the section ``Parameters``, by field.
    """
    help_, _, section = text.partition("\nParameters\n----------\n")
    descriptions = {}
    for entry in re.split(r"\n(?=\S)", section.strip()) if section else []:
        head, _, words = entry.partition("\n")
        field, *rest = head.split()
        names = [word for word in rest if word.startswith("--")]
        metavar = " ".join(word for word in rest if word not in names) or None
        descriptions[field] = Described(names, metavar, " ".join(words.split()))
    return help_.rstrip(), descriptions


def _parameters(
    options: type[tuple[Any, ...]], descriptions: dict[str, Described]
) -> Iterator[inspect.Parameter]:
    """Yield typer's parameter for each field of an options class.

    The description of a field is removed from ``descriptions``, so that entries remain for which
    there is no field.
    """
    defaults: Mapping[str, Any] = options._field_defaults  # type: ignore[attr-defined]
    for name, hint in get_type_hints(options, include_extras=True).items():
        kind, info = get_args(hint) if hasattr(hint, "__metadata__") else (hint, typer.Option())
        if (description := descriptions.pop(name, None)) is not None:
            info = copy.copy(info)
            info.param_decls = description.names or info.param_decls
            info.metavar = description.metavar or info.metavar
            info.help = description.help
        yield parameter(name, Annotated[kind, info], defaults.get(name, inspect.Parameter.empty))


def parameter(
    name: str, annotation: Any, default: Any = inspect.Parameter.empty
) -> inspect.Parameter:
    """Return a keyword parameter of a command: its name, typer's annotation, and default value."""
    kind = inspect.Parameter.KEYWORD_ONLY
    return inspect.Parameter(name, kind, default=default, annotation=annotation)


def set_signature(function: Callable[..., None], parameters: list[inspect.Parameter]) -> None:
    """Give a function that takes ``**values`` the parameters that typer shows as its options."""
    function.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    function.__annotations__ = {option.name: option.annotation for option in parameters}


_FILES = Path(__file__).parents[1].joinpath("engine", "integrate", "steppers").glob("[a-z]*.py")
STEPPERS = ("auto", *sorted(file.stem.replace("_", "-") for file in _FILES))
"""Names of the steppers, from their files, because importing the registry would slow down --help. A
test compares them."""

SceneName = Annotated[
    str,
    Argument(
        help="Scene, the description of a drive and its run: a name from `ab-sim scenes`, or a "
        "YAML file."
    ),
]
Recording = Annotated[
    Path, Argument(metavar="FILE", help="Recording of a run, e.g. by `ab-sim run --rrd`: .rrd.")
]
Bag = Annotated[
    Path, Argument(metavar="BAG", help="ROS 2 bag: its folder, or its .mcap or .db3 file.")
]
Changes = Annotated[
    list[str],
    Option(
        "--set",
        metavar="KEY=VALUE",
        help="Change a key of the scene, e.g. balls.mass=0.002 (SI units) or 'balls.mass=2 g'. "
        "An empty value removes the key. accuracy.angle=1e-9 (error of ball angles [rad]) or "
        "accuracy.whirl=1e-6 (error of the whirl [e], in eccentricities) chooses the cheapest "
        "stepper and step with at most this error. Repeatable.",
    ),
]
Speed = Annotated[
    float | None,
    Option(
        metavar="SPEED",
        help="Constant spindle speed [rad/s]. Default: the final speed of the scene's profile.",
    ),
]
Json = Annotated[
    str | None,
    Option(
        metavar="FILE|-",
        help="Write the result as JSON: .json, or - for standard output. Fields: "
        "docs/reference, page JSON.",
    ),
]
ListJson = Annotated[bool, Option("--json", help="Print the list as JSON.")]
Plot = Annotated[Path | None, Option(metavar="FILE", help="Draw the result: .png, .svg or .pdf.")]
Parquet = Annotated[
    Path | None, Option(metavar="FILE", help="Write a table with a row for each run: .parquet.")
]
Csv = Annotated[
    Path | None, Option(metavar="FILE", help="Write a table with a row for each run: .csv.")
]
Units = Annotated[
    str,
    Option(
        metavar="UNIT,UNIT,...",
        help="Units of tables and pictures, e.g. 'rpm,g mm,deg'; files keep SI units.",
    ),
]
Seed = Annotated[
    int,
    Option(
        metavar="N", min=0, help="Seed of the random numbers; the same seed repeats the result."
    ),
]
Workers = Annotated[
    int | None,
    Option(metavar="N", help="Number of parallel processes. Default: the number of processors."),
]
Scheduler = Annotated[
    str | None,
    Option(
        metavar="ADDRESS",
        help="Address of a Dask cluster to use instead of local processes: HOST:PORT, "
        "tcp://HOST:PORT or tls://HOST:PORT. Its workers need the same version of ab_sim.",
    ),
]
Repeats = Annotated[
    int,
    Option(metavar="N", help="Number of measurements of each time; their median is reported."),
]
Quartiles = Annotated[
    bool, Option("--quartiles", help="Also show the quartiles of the times, in a wider table.")
]
View = Annotated[
    str,
    Option(
        metavar="none|web|native|URL",
        help="Watch the run in Rerun's viewer: in a browser (web), in a window (native), or in a "
        "running viewer at rerun+http://HOST:PORT/proxy.",
    ),
]
Now = Annotated[bool, Option("--now", help="With --view web: start without waiting for a browser.")]
Namespace = Annotated[
    str | None,
    Option(
        metavar="NAME",
        help="ROS namespace of the drive, if the bag has several drives, e.g. /left.",
    ),
]
