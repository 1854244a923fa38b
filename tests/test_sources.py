"""Sources of a kernel: own modules by content, other packages by version."""

from importlib import metadata
from pathlib import Path

import yaml

from ab_sim.base.sources import sources, versions

DRIVE = "ab_sim.drive.drive"


def test_a_package_counts_by_the_version_of_the_distribution_that_has_it() -> None:
    found = sources([DRIVE])
    assert "ab_sim.base.yaml_files" in found  # imports yaml, which PyYAML installs
    assert not [module for module in found if module.partition(".")[0] == "yaml"]
    assert versions(found)["yaml"] == metadata.version("PyYAML")
    assert versions(found)["numpy"] == metadata.version("numpy")


def test_another_environment_that_links_the_same_files_changes_nothing() -> None:
    """uv links files into other environments meanwhile, which changes a file's ctime, as here."""
    file = Path(yaml.__file__)
    file.chmod(file.stat().st_mode)
    assert DRIVE in sources([DRIVE])
