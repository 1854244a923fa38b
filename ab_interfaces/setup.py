"""Build the Python classes of ROS interfaces for ROS 2 from PyPI, for `make action`.

The interfaces are the action of ab_interfaces, and the part of ROS's simulation_interfaces that
drive_sim offers. With a ROS 2 of a distribution, this file is not needed: colcon builds
ab_interfaces by its CMakeLists.txt, and the distribution has simulation_interfaces. PyPI lacks some
packages that CMakeLists.txt requires, but has ROS's generators, which write the same code. This
needs compilers for C and C++, and the headers of Python (python3-dev).
"""

import os
import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy
from rosidl_adapter import convert_to_idl
from rosidl_generator_c.cli import GenerateC
from rosidl_generator_py.cli import GeneratePython
from rosidl_generator_type_description.cli import HashTypeDescription
from rosidl_typesupport_c.cli import GenerateCTypesupport
from rosidl_typesupport_fastrtps_c.cli import GenerateFastRTPSCTypesupport
from rosidl_typesupport_introspection_c.cli import GenerateIntrospectionCTypesupport
from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

FOLDERS = {"ab_interfaces": Path(), "simulation_interfaces": Path("simulation_interfaces")}
"""Folder of the definitions of each package."""
PREFIX = Path(sys.prefix)
os.environ["AMENT_PREFIX_PATH"] = str(PREFIX)  # ROS's generators search their templates here
FAST, INTROSPECTION = "rosidl_typesupport_fastrtps_c", "rosidl_typesupport_introspection_c"
USED = (
    *("action_msgs", "builtin_interfaces", "geometry_msgs", "service_msgs", "std_msgs"),
    "unique_identifier_msgs",
)
"""Packages with messages that the interfaces contain."""
LIBRARIES = [
    *("fastcdr", "rcutils", "rosidl_runtime_c", "rosidl_typesupport_c"),
    *(FAST, FAST.replace("_c", "_cpp"), INTROSPECTION),
    *(f"{used}__rosidl_generator_{kind}" for used in USED for kind in ("c", "py")),
    *(f"{used}__{kind}" for used in USED for kind in ("rosidl_typesupport_c", FAST, INTROSPECTION)),
]


class Interfaces:
    """Definitions of a package, and the code generated from them.

    Parameters
    ----------
    name
        Name of the package.
    folder
        Folder of its definitions.
    """

    def __init__(self, name: str, folder: Path) -> None:
        self.name, self.folder = name, folder
        self.definitions = sorted(
            path.relative_to(folder)
            for kind in ("action", "msg", "srv")
            for path in folder.glob(f"{kind}/*.{kind}")
        )
        self.package = Path("build", "first", name)
        """Folder of the Python package, and of most of its generated C and C++ code."""
        self.introspection = Path("build", "second", name)
        """Folder of the introspection library, whose files have the same names as others."""

    def generate(self) -> None:
        """Generate the code of the package with ROS's generators."""
        name, package = self.name, self.package
        share = package.parent / "share" / name
        for path in self.definitions:
            convert_to_idl(self.folder.absolute(), name, path, share)
        files = [f"{share.absolute()}:{path.with_suffix('.idl')}" for path in self.definitions]
        used = [str(PREFIX / "share" / package) for package in USED]
        hashes = HashTypeDescription("hash").generate_type_hashes(name, files, used, package)
        stems = {path.stem for path in self.definitions}
        GenerateC("c").generate(
            name, files, used, package, [str(path) for path in hashes if path.stem in stems]
        )
        for generator in (
            GeneratePython("py", typesupport_implementations=["rosidl_typesupport_c"]),
            GenerateCTypesupport("c", typesupport_implementations=[FAST, INTROSPECTION]),
            GenerateFastRTPSCTypesupport("fastrtps_c"),
        ):
            generator.generate(name, files, used, package)
        introspection = GenerateIntrospectionCTypesupport("introspection_c")
        introspection.generate(name, files, used, self.introspection)
        (package / "__init__.py").touch()

    def extensions(self) -> list[Extension]:
        """Return the extensions to compile: two libraries, and the module that links them."""
        first, second = f"{self.name}__{FAST}", f"{self.name}__{INTROSPECTION}"
        kinds = {path.parent.name for path in self.definitions}
        compiled = [
            *(path for kind in kinds for path in self.package.glob(f"{kind}/*.cpp")),
            *(path for kind in kinds for path in self.package.glob(f"{kind}/detail/*.c*")),
        ]
        return [
            self._built(f"lib{first}", compiled),
            self._built(f"lib{second}", [*self.introspection.rglob("*.c")], first),
            self._built(
                f"{self.name}_s__rosidl_typesupport_c",
                [*self.package.rglob("*_s.*")],
                *(first, second),
            ),
        ]

    def installed(self) -> list[tuple[str, list[str]]]:
        """Return the data files by which ROS's tools find the interfaces: (folder, files)."""
        index = "share/ament_index/resource_index"
        share = f"share/{self.name}"
        return [
            (f"{index}/packages", [f"resource/{self.name}"]),
            (f"{index}/rosidl_interfaces", [f"resource/rosidl_interfaces/{self.name}"]),
            *((f"{share}/{path.parent}", [str(self.folder / path)]) for path in self.definitions),
        ]

    def _built(self, name: str, sources: list[Path], *beside: str) -> Extension:
        headers = sorted(path for path in (PREFIX / "include").iterdir() if path.name != "site")
        return Extension(
            f"{self.name}.{name}",
            sources=self._units(name, sources),
            include_dirs=[
                str(self.package.parent),
                str(self.introspection.parent),
                numpy.get_include(),
                *map(str, headers),
            ],
            libraries=[*beside, *LIBRARIES],
            define_macros=[("ROS_PACKAGE_NAME", f'"{self.name}"')],
            extra_compile_args=["-O1", "-g0"],
            language="c++",
        )

    def _units(self, name: str, sources: list[Path]) -> list[str]:
        """Write a file that includes all sources of a language, and return the files to compile.

        This way, the compiler reads ROS's headers only once per language. Type descriptions are
        compiled separately, because several of them define the same names.
        """
        files = [str(path) for path in sources if path.stem.endswith("__description")]
        for suffix in (".c", ".cpp"):
            unit = Path("build", f"{name}_{suffix[1:]}{suffix}")
            unit.write_text(
                "".join(
                    f'#include "{path.absolute()}"\n'
                    for path in sorted(sources)
                    if path.suffix == suffix and str(path) not in files
                ),
                encoding="utf-8",
            )
            files.append(str(unit))
        return sorted(files)


class Build(build_ext):
    """Compiler command that gives libraries the names by which ROS finds them, once loaded."""

    def get_ext_filename(self, fullname: str) -> str:
        """Return the path of a library, without Python's suffix, or of a module."""
        package, _, name = fullname.rpartition(".")
        if name.startswith("lib"):
            return str(Path(*package.split("."), f"{name}.so"))
        return str(super().get_ext_filename(fullname))

    def build_extension(self, extension: Extension) -> None:
        """Build an extension; it is linked with earlier ones in the same folder."""
        beside = Path(self.get_ext_fullpath(extension.name)).parent
        name = Path(self.get_ext_filename(extension.name)).name
        extension.library_dirs = [str(beside), str(PREFIX / "lib")]
        # Keep the link to the introspection library, although no symbol of it is used: ROS loads it
        # by name. The option must come before the libraries.
        extension.extra_objects = ["-Wl,--no-as-needed"]
        extension.extra_link_args = [f"-Wl,-soname,{name}", "-Wl,-rpath,$ORIGIN"]
        super().build_extension(extension)

    def get_export_symbols(self, extension: Extension) -> list[str]:
        """Return no names, so that all symbols are exported."""
        return []


interfaces = [Interfaces(name, folder) for name, folder in FOLDERS.items()]
for each in interfaces:
    each.generate()
ros = ElementTree.parse("package.xml")
setup(
    name="ab_interfaces",
    version=ros.findtext("version"),
    description=ros.findtext("description"),
    license=ros.findtext("license"),
    packages=[
        ".".join((each.name, *kind))
        for each in interfaces
        for kind in [(), *{(path.parent.name,) for path in each.definitions}]
    ],
    package_dir={each.name: str(each.package) for each in interfaces},
    cmdclass={"build_ext": Build},
    ext_modules=[extension for each in interfaces for extension in each.extensions()],
    data_files=[
        ("share/ab_interfaces", ["package.xml"]),
        *(entry for each in interfaces for entry in each.installed()),
    ],
)
