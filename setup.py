"""Packaging that serves pip and colcon alike.

All metadata is here and none in pyproject.toml or a setup.cfg: `requires-python` in a [project]
table breaks colcon, and the usual setup.cfg puts the nodes in bin/ under pip, where `ros2 run`
does not look.
"""

import re
from glob import glob
from pathlib import Path
from xml.etree import ElementTree

from setuptools import find_packages, setup

NAME = "ab_sim"
CLUSTER = ["dask", "distributed"]
PEERS = ["mujoco", "scikit-sundae"]
MINORS = (".10", ".11", ".12", ".13", ".14")
LINKS = {
    "Paper on three balls": "https://doi.org/10.1115/1.2948415",
    "Paper on two planes": "https://doi.org/10.1016/j.ijnonlinmec.2008.01.002",
}
"""Links of the sources. Those of the project are the url elements of package.xml: none is known."""
# The last myst-parser for Python 3.10 does not go with rich's markdown-it-py.
DOCS = [
    f"{package}; python_version >= '3.11'"
    for package in ("furo", "myst-parser", "sphinx", "sphinx-design", "sphinx-gallery")
]

# The version is read from the source, because a build cannot import the package without NumPy.
version = re.search(
    r'^__version__ = "(.+)"$',
    Path(NAME, "base", "version.py").read_text(encoding="utf-8"),
    re.MULTILINE,
)
assert version, f"{NAME}/base/version.py does not set __version__"

ros = ElementTree.parse("package.xml")
maintainer = ros.find("maintainer")
assert maintainer is not None, "package.xml names no maintainer"

setup(
    name=NAME,
    version=version.group(1),
    description=ros.findtext("description"),
    long_description=Path("README.md").read_text(encoding="utf-8"),
    long_description_content_type="text/markdown",
    author=maintainer.text,
    author_email=maintainer.get("email"),
    license=ros.findtext("license"),
    project_urls=LINKS
    | {str(url.get("type")).title(): str(url.text) for url in ros.findall("url")},
    keywords=["automatic balancer", "rotor dynamics", "optical disc drive", "ROS 2", "simulation"],
    classifiers=[
        "Development Status :: 4 - Beta",
        "Environment :: Console",
        "Intended Audience :: Developers",
        "Intended Audience :: Science/Research",
        "Operating System :: POSIX :: Linux",
        *(f"Programming Language :: Python :: 3{minor}" for minor in ("", *MINORS)),
        "Topic :: Scientific/Engineering :: Physics",
        "Typing :: Typed",
    ],
    python_requires=">=3.10",
    package_dir={"": "."},  # an editable install is a path then, which type checkers follow
    packages=find_packages(include=["ab_sim", "ab_sim.*", "ab_msgs_py"]),
    package_data={
        "ab_sim": [
            *("py.typed", "nodes/*.xml"),
            *("export/c_code/template_files/*", "export/c_code/fmi_headers/*.h"),
        ],
        "ab_msgs_py": ["py.typed"],
    },
    install_requires=[
        "filelock>=3.30",  # lock_descriptor
        "llvmlite>=0.45",  # opaque pointers, and the pass manager that is left
        "matplotlib>=3.9",  # 3.9 is the first for numpy 2
        "numpy>=2",
        "pint>=0.24.4",
        "platformdirs>=4",
        "plotly>=6",
        "psutil>=5.9",
        "pyarrow>=22",  # quoting_header of CSV files
        "pydantic>=2.10",
        "PyYAML>=6",
        "rerun-sdk>=0.39",  # 0.39 is the last for Python 3.10
        "rich>=13",
        "rosbags>=0.11.7",  # from there on with backports.zstd
        "scipy>=1.15",
        "typer>=0.15.4",  # earlier ones fail with click 8.2 and later
    ],
    extras_require={
        # With a ROS 2 from the distribution these are there already (package.xml names them).
        "ros": [
            "ros-rclpy[fastrtps]",
            "ros-diagnostic-msgs",
            "ros-geometry-msgs",
            "ros-lifecycle-msgs",
            "ros-rcl-interfaces",
            "ros-rosgraph-msgs",
            "ros-sensor-msgs",
            "ros-std-msgs",
            "ros-std-srvs",
            "ros-trajectory-msgs",
        ],
        # Work on more than one machine: `--scheduler`.
        "cluster": CLUSTER,
        # What the accuracy study is compared with, which its tests need, too; and what only
        # benchmarks are compared with.
        "peers": [*PEERS, "heyoka; python_version >= '3.11'"],
        "docs": DOCS,
        "dev": [
            *CLUSTER,
            *PEERS,
            *DOCS,
            "build",
            "colcon-bash",
            "colcon-ros",
            "hypothesis",
            "jsonschema",  # says whether scenes fit the schema for editors
            "mcap-ros2-support",  # reads what rosbags wrote
            "mpmath",
            "mypy",
            "pandas; python_version >= '3.11'",  # what results become, where it is there
            "osrf-pycommon",  # what ROS's launch needs, of which there is no wheel
            "playwright",  # drives Debian's Chromium
            "pre-commit",
            "pytest",
            "pytest-cov",
            "pytest-timeout",
            "pytest-xdist",
            "ruff",
            "scipy-stubs; python_version >= '3.11'",
            "types-PyYAML",
            "types-psutil",
            "xarray; python_version >= '3.11'",  # what sweeps become, where it is there
            "xmlschema",  # says whether an FMU's descriptions fit the schemas of FMI
        ],
    },
    entry_points={"console_scripts": ["ab-sim = ab_sim.cli:main"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/config/nodes", glob("config/nodes/*.yaml")),
        (f"share/{NAME}/config/scenes", glob("config/scenes/*.yaml")),
        (f"share/{NAME}/launch", glob("launch/*.launch.py")),
        # `ros2 run` looks for executables in lib/<package>.
        (f"lib/{NAME}", glob("scripts/[!_]*")),
    ],
)
