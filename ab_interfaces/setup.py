"""The action's Python classes for ROS 2 from PyPI: `make action` installs them beside the wheels.

A ROS 2 of a distribution needs no such thing: colcon builds the package by its CMakeLists.txt. PyPI
lacks some of the packages that those lines ask for, but has ROS's generators, which make the same
code here. That takes a compiler for C and C++, and the headers of Python (python3-dev).
"""

import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy
from rosidl_adapter.action import convert_action_to_idl
from rosidl_generator_c.cli import GenerateC
from rosidl_generator_py.cli import GeneratePython
from rosidl_generator_type_description.cli import HashTypeDescription
from rosidl_typesupport_c.cli import GenerateCTypesupport
from rosidl_typesupport_fastrtps_c.cli import GenerateFastRTPSCTypesupport
from rosidl_typesupport_introspection_c.cli import GenerateIntrospectionCTypesupport
from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

NAME = "ab_interfaces"
ACTION = Path("action", "RunProfile.action")
PREFIX = Path(sys.prefix)
FAST, INTROSPECTION = "rosidl_typesupport_fastrtps_c", "rosidl_typesupport_introspection_c"
USED = ("action_msgs", "builtin_interfaces", "service_msgs", "unique_identifier_msgs")
"""Packages whose messages are in each action's own."""
LIBRARIES = [
    *("fastcdr", "rcutils", "rosidl_runtime_c", "rosidl_typesupport_c"),
    *(FAST, FAST.replace("_c", "_cpp"), INTROSPECTION),
    *(f"{used}__rosidl_generator_{kind}" for used in USED for kind in ("c", "py")),
    *(f"{used}__{kind}" for used in USED for kind in ("rosidl_typesupport_c", FAST, INTROSPECTION)),
]


def generate(package: Path, introspection: Path) -> None:
    """Write the action's code.

    Args:
        package: folder of the Python package, and of most of what is compiled for it.
        introspection: folder of a second library, whose files have names of the first's.
    """
    share = package.parent / "share"
    convert_action_to_idl(Path.cwd(), NAME, ACTION, share / ACTION.parent)
    files = [f"{share.absolute()}:{ACTION.with_suffix('.idl')}"]
    used = [str(PREFIX / "share" / package) for package in USED]
    hashes = HashTypeDescription("hash").generate_type_hashes(NAME, files, used, package)
    GenerateC("c").generate(
        NAME, files, used, package, [str(path) for path in hashes if path.stem == ACTION.stem]
    )
    for generator in (
        GeneratePython("py", typesupport_implementations=["rosidl_typesupport_c"]),
        GenerateCTypesupport("c", typesupport_implementations=[FAST, INTROSPECTION]),
        GenerateFastRTPSCTypesupport("fastrtps_c"),
    ):
        generator.generate(NAME, files, used, package)
    GenerateIntrospectionCTypesupport("introspection_c").generate(NAME, files, used, introspection)
    (package / "__init__.py").touch()


class Build(build_ext):
    """Libraries have the names by which ROS looks for them: it finds those that are loaded."""

    def get_ext_filename(self, fullname: str) -> str:
        """Of a library or a module."""
        package, _, name = fullname.rpartition(".")
        if name.startswith("lib"):
            return str(Path(*package.split("."), f"{name}.so"))
        return str(super().get_ext_filename(fullname))

    def build_extension(self, extension: Extension) -> None:
        """Link what was built before, which lies beside it."""
        beside = Path(self.get_ext_fullpath(extension.name)).parent
        name = Path(self.get_ext_filename(extension.name)).name
        extension.library_dirs = [str(beside), str(PREFIX / "lib")]
        # Before the libraries: the second one is needed, though nothing calls it by its own name.
        extension.extra_objects = ["-Wl,--no-as-needed"]
        extension.extra_link_args = [f"-Wl,-soname,{name}", "-Wl,-rpath,$ORIGIN"]
        super().build_extension(extension)

    def get_export_symbols(self, extension: Extension) -> list[str]:
        """Whatever there is."""
        return []


package, introspection = Path("build", "first", NAME), Path("build", "second", NAME)
generate(package, introspection)
headers = sorted(path for path in (PREFIX / "include").iterdir() if path.name != "site")


def built(name: str, sources: list[Path], *beside: str) -> Extension:
    """Return a library, or the module."""
    return Extension(
        f"{NAME}.{name}",
        sources=sorted(str(path) for path in sources),
        include_dirs=[
            str(package.parent),
            str(introspection.parent),
            numpy.get_include(),
            *map(str, headers),
        ],
        libraries=[*beside, *LIBRARIES],
        define_macros=[("ROS_PACKAGE_NAME", f'"{NAME}"')],
        language="c++",
    )


first, second = f"{NAME}__{FAST}", f"{NAME}__{INTROSPECTION}"
ros = ElementTree.parse("package.xml")
setup(
    name=NAME,
    version=ros.findtext("version"),
    description=ros.findtext("description"),
    license=ros.findtext("license"),
    packages=[NAME, f"{NAME}.action"],
    package_dir={NAME: str(package)},
    cmdclass={"build_ext": Build},
    ext_modules=[
        built(f"lib{first}", [*package.glob("action/*.cpp"), *package.glob("action/detail/*.c*")]),
        built(f"lib{second}", [*introspection.rglob("*.c")], first),
        built(f"{NAME}_s__rosidl_typesupport_c", [*package.rglob("*_s.*")], first, second),
    ],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (
            "share/ament_index/resource_index/rosidl_interfaces",
            [f"resource/rosidl_interfaces/{NAME}"],
        ),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/{ACTION.parent}", [str(ACTION)]),
    ],
)
