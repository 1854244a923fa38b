"""The action's Python classes for ROS 2 from PyPI: `make action` installs them beside the wheels.

A ROS 2 of a distribution needs no such thing: colcon builds the package by its CMakeLists.txt.
PyPI lacks some of the packages that those lines ask for, but has ROS's generators. These are asked
here for the same code, of which one extension module is made: it needs a compiler for C and C++, and
the headers of Python (python3-dev).
"""

import sys
from pathlib import Path

import numpy
from rosidl_adapter.action import convert_action_to_idl
from rosidl_generator_c.cli import GenerateC
from rosidl_generator_py.cli import GeneratePython
from rosidl_generator_type_description.cli import HashTypeDescription
from rosidl_typesupport_c.cli import GenerateCTypesupport
from rosidl_typesupport_fastrtps_c.cli import GenerateFastRTPSCTypesupport
from setuptools import Extension, setup

NAME = "ab_interfaces"
ACTION = Path("action", "RunProfile.action")
PREFIX = Path(sys.prefix)
USED = ("action_msgs", "builtin_interfaces", "service_msgs", "unique_identifier_msgs")
"""Packages whose messages are in each action's own."""
LIBRARIES = (
    "fastcdr",
    "rcutils",
    "rosidl_runtime_c",
    "rosidl_typesupport_c",
    "rosidl_typesupport_fastrtps_c",
    "rosidl_typesupport_fastrtps_cpp",
    *(f"{package}__rosidl_generator_c" for package in USED),
    *(f"{package}__rosidl_generator_py" for package in USED),
    *(f"{package}__rosidl_typesupport_c" for package in USED),
    *(f"{package}__rosidl_typesupport_fastrtps_c" for package in USED),
)


def generate(into: Path) -> Path:
    """Write the action's code; the folder of its Python package."""
    share, package = into / "share", into / NAME
    convert_action_to_idl(Path.cwd(), NAME, ACTION, share / ACTION.parent)
    files = [f"{share.absolute()}:{ACTION.with_suffix('.idl')}"]
    used = [str(PREFIX / "share" / package) for package in USED]
    hashes = HashTypeDescription("hash").generate_type_hashes(NAME, files, used, package)
    described = [str(path) for path in hashes if path.stem == ACTION.stem]
    GenerateC("c").generate(NAME, files, used, package, described)
    kinds = {"typesupport_implementations": ["rosidl_typesupport_c"]}
    GeneratePython("py", **kinds).generate(NAME, files, used, package)
    # With one implementation it is called, with several it is looked for in libraries.
    kinds = {"typesupport_implementations": ["rosidl_typesupport_fastrtps_c"]}
    GenerateCTypesupport("c", **kinds).generate(NAME, files, used, package)
    GenerateFastRTPSCTypesupport("fastrtps_c").generate(NAME, files, used, package)
    (package / "__init__.py").touch()
    return package


package = generate(Path("build", "generated"))
headers = sorted(path for path in (PREFIX / "include").iterdir() if path.name != "site")
setup(
    name=NAME,
    version="0.1.0",
    description="The action by which a start-up profile is run on a drive of ab_sim",
    license="Apache-2.0",
    packages=[NAME, f"{NAME}.action"],
    package_dir={NAME: str(package)},
    ext_modules=[
        Extension(
            f"{NAME}.{NAME}_s__rosidl_typesupport_c",
            sources=[str(path) for path in sorted(package.rglob("*.c*"))],
            include_dirs=[str(package.parent), numpy.get_include(), *map(str, headers)],
            library_dirs=[str(PREFIX / "lib")],
            libraries=list(LIBRARIES),
            define_macros=[("ROS_PACKAGE_NAME", f'"{NAME}"')],
        )
    ],
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/" + NAME]),
        ("share/ament_index/resource_index/rosidl_interfaces", ["resource/rosidl_interfaces/" + NAME]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/{ACTION.parent}", [str(ACTION)]),
    ],
)
