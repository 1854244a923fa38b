"""Drive as an FMU of FMI 3.0 for co-simulation: sources, and a binary if there is a compiler."""

import hashlib
import io
import platform
import re
import shutil
import subprocess
import tempfile
import zipfile
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path
from typing import NamedTuple

from ab_sim.base.errors import InputError
from ab_sim.export.c_code.model_description import (
    Variable,
    build_description,
    model_description,
    variables_of,
)
from ab_sim.export.c_code.sources import DriveSources
from ab_sim.export.c_code.templates import filled, in_html

HEADERS = files("ab_sim.export.c_code") / "fmi_headers"
"""Folder of the standard's headers (2-clause BSD licence)."""
HEADER_NAMES = ("fmi3PlatformTypes.h", "fmi3FunctionTypes.h", "fmi3Functions.h")
EXTRA = "extra/org.fmi-standard"
"""Folder of the headers in an FMU, outside the sources, because importers have these headers."""
FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-fvisibility=hidden", "-shared", "-fPIC")
_FUNCTION = re.compile(r"typedef\s+fmi3Status\s+(fmi3\w+)TYPE\s*\(([^;]*)\);")
_PRIVATE = re.compile(
    r"\bdrive_(init|reset|follow_profile|command|command_ramp|step|step_part|update|time|whirl|tilt)\b"
)
"""Pattern of the functions of drive.h."""


class Fmu(NamedTuple):
    """Complete FMU."""

    content: bytes
    """Content of the file."""
    binary: str | None
    """Platform of the binary; None if there is no binary."""
    variables: tuple[Variable, ...]


def fmu_of(sources: DriveSources, identifier: str) -> Fmu:
    """Return the FMU of a drive.

    Args:
        sources: sources of the drive.
        identifier: name of the model, a C identifier.

    Raises:
        InputError: the C compiler fails.
    """
    variables, machine = variables_of(sources), platform_tuple()
    drive = {name: sources.files[name] for name in ("drive.h", "drive.c")}
    token = "{" + hashlib.sha256("".join(drive.values()).encode()).hexdigest()[:32] + "}"
    values = {
        "MADE_BY": sources.made_by,
        "TITLE": sources.title,
        "IDENTIFIER": identifier,
        "TOKEN": token,
        "VARIABLES": "".join(_rows(variables)),
        "FOLLOW_PROFILE": str([variable.name for variable in variables].index("follow_profile")),
        "PLATFORM": machine,
    }
    flags = {"quaternion": "qw" in sources.channels}
    text = filled("fmu.c", {**values, "UNSUPPORTED": ""}, flags)
    values["UNSUPPORTED"] = "\n".join(_unsupported(text))
    renamed = drive | {"fmu.c": filled("fmu.c", values, flags)}
    # Prefixed names, because several FMUs may be linked into one program.
    renamed = {
        name: _PRIVATE.sub(rf"{identifier}_drive_\1", text) for name, text in renamed.items()
    }
    binary = _binary(renamed)
    documentation = filled("fmu.html", values | {"MADE_BY": in_html(values["MADE_BY"])}, flags)
    content = {
        "modelDescription.xml": model_description(sources.scene, variables, identifier, token),
        "sources/buildDescription.xml": build_description(identifier, ["drive.c", "fmu.c"]),
        **{f"sources/{name}": text.encode() for name, text in renamed.items()},
        **{f"{EXTRA}/{name}": (HEADERS / name).read_bytes() for name in HEADER_NAMES},
        "documentation/index.html": documentation.encode(),
    }
    if binary is not None:
        content[f"binaries/{machine}/{identifier}.so"] = binary
    return Fmu(_zipped(content), None if binary is None else machine, tuple(variables))


def identifier_of(name: str) -> str:
    """Convert a file's name to a C identifier."""
    plain = re.sub(r"\W", "_", name, flags=re.ASCII)
    return plain if re.match("[A-Za-z]", plain) else f"drive_{plain}"


def platform_tuple() -> str:
    """Return this machine's platform tuple of FMI."""
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(
        platform.machine().lower(), platform.machine().lower()
    )
    return f"{machine}-{platform.system().lower()}"


def _rows(variables: list[Variable]) -> Iterator[str]:
    for reference, variable in enumerate(variables):
        values = f"{reference}, {variable.settable}, AT({variable.place}), {_least(variable)}"
        yield f"    {{{values}}}, /* {variable.name} */\n"


def _least(variable: Variable) -> str:
    """Return a constant's smallest accepted value in C; -INFINITY for all other variables."""
    is_constant = variable.place.startswith("drive.p.") and "min" in variable.attributes
    return variable.attributes["min"] if is_constant else "-INFINITY"


def _unsupported(text: str) -> Iterator[str]:
    """Yield a function that fails for each function of the standard that the text lacks."""
    for name, arguments in _FUNCTION.findall((HEADERS / HEADER_NAMES[1]).read_text()):
        if f"\nfmi3Status {name}(" in text:
            continue
        parameters = [" ".join(one.split()) for one in arguments.split(",")]
        unused = [re.sub(r"\[\]$", "", one).rpartition(" ")[2].lstrip("*") for one in parameters]
        void = ", ".join(f"(void){word}" for word in unused if word != "instance")
        yield (
            f"fmi3Status {name}({', '.join(parameters)})\n{{\n"
            + (f"    {void};\n" if void else "")
            + f'    return unsupported(instance, "{name}");\n}}\n'
        )


def _binary(sources: dict[str, str]) -> bytes | None:
    """Compile the shared library; return None without a C compiler.

    Raises:
        InputError: the compiler fails.
    """
    compiler = shutil.which("cc")
    if compiler is None:
        return None
    with tempfile.TemporaryDirectory(prefix="ab_sim-fmu-") as name:
        folder = Path(name)
        for file, text in sources.items():
            (folder / file).write_text(text, encoding="utf-8")
        for file in HEADER_NAMES:
            (folder / file).write_bytes((HEADERS / file).read_bytes())
        words = [compiler, *FLAGS, "drive.c", "fmu.c", "-o", "fmu.so", "-lm"]
        result = subprocess.run(words, cwd=folder, capture_output=True, text=True)
        if result.returncode:
            message = next((line for line in result.stderr.splitlines() if "error" in line), "")
            raise InputError(
                f"{compiler}: cannot build the FMU's binary: {message or result.stderr.strip()}; "
                "repair the compiler, or hide it from PATH for an FMU of sources alone"
            )
        return (folder / "fmu.so").read_bytes()


def _zipped(content: dict[str, bytes]) -> bytes:
    """Return a ZIP archive that depends only on the content, not on times."""
    archive_bytes = io.BytesIO()
    with zipfile.ZipFile(archive_bytes, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in content.items():
            info = zipfile.ZipInfo(name)
            info.compress_type = zipfile.ZIP_DEFLATED
            info.external_attr = (0o755 if name.endswith(".so") else 0o644) << 16
            archive.writestr(info, data)
    return archive_bytes.getvalue()
