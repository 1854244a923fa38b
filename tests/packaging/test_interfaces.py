"""The types of simulation_interfaces that are built here have the hashes of the standard."""

import json
import sys
from pathlib import Path

import pytest

pytest.importorskip("rosidl_generator_type_description", reason="needs ROS 2 from PyPI")
pytestmark = pytest.mark.ros

ROOT = Path(__file__).parents[2]
NAME = "simulation_interfaces"
USED = (
    *("action_msgs", "builtin_interfaces", "geometry_msgs", "service_msgs", "std_msgs"),
    "unique_identifier_msgs",
)
# Made by ROS's generator from simulation_interfaces, tag 2.1.0.
STANDARD = {
    "action/SimulateSteps": "f0837c898e1219cd73bf4c041feab41e8c533e8e1057e982744dba7b093467eb",
    "srv/GetAvailableWorlds": "ce5589b5523f2732d1969a3c5a7e6b17a387091df8190c62f78d7fdd1109e3e3",
    "srv/GetCurrentWorld": "79ed4e910e1b7a1c9f7950ff758bfba3535bf0dec669054e8af115a099724ddd",
    "srv/GetEntities": "cb90004c48cd50f37732fb008e22c34c261dd680a723bf0f85d8437ea4498bf7",
    "srv/GetEntitiesStates": "0a76170d0c1c90e1eaf805cfab78ea801d1f82df309a28c1f0fae4b570f19754",
    "srv/GetEntityState": "749c91f2a2353d98367b64f2995a0f5842ce92a08ec1ffb3e185540a91557fb5",
    "srv/GetSimulationState": "3362dcebee4b1afebbf9c4beee5c79c1455385aded62092a892d61fde8644f30",
    "srv/GetSimulatorFeatures": "abb9439c8cf196722a469fb6c68b44b484f198c2a1356ac38849a29c2a20a794",
    "srv/LoadWorld": "87d0ded1bfddb40a74d0bedb963fdd592fbedb14d0057d597850404b73c338af",
    "srv/ResetSimulation": "4ce285d7ff9b8ac70dcc95161f32bf54c05a6f4b13427990e41ab40c36c39646",
    "srv/SetEntityState": "fba636c91d38832dbd4f6896ffce54ff98fd9929962b0533546b56ce00f988ac",
    "srv/SetSimulationState": "a868b916dce49974f637ba252141258c4b07b0c06858b88af560e3eb6bfbcb30",
    "srv/StepSimulation": "913fe0653690ce6bf8f09f316e6a626747012e9fca31e26719910d417aa8565c",
}


def test_the_types_are_those_of_the_standard(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("AMENT_PREFIX_PATH", sys.prefix)
    from rosidl_adapter import convert_to_idl
    from rosidl_generator_type_description.cli import HashTypeDescription

    folder = ROOT / "ab_interfaces" / NAME
    definitions = sorted(path.relative_to(folder) for path in folder.glob("*/*"))
    for path in definitions:
        convert_to_idl(folder, NAME, path, tmp_path)
    files = [f"{tmp_path}:{path.with_suffix('.idl')}" for path in definitions]
    used = [str(Path(sys.prefix, "share", package)) for package in USED]
    written = HashTypeDescription("hash").generate_type_hashes(NAME, files, used, tmp_path / "out")
    hashes = {
        each["type_name"].removeprefix(f"{NAME}/"): each["hash_string"]
        for path in written
        for each in json.loads(path.read_text())["type_hashes"]
    }
    assert {name: hashes[name].removeprefix("RIHS01_") for name in STANDARD} == STANDARD
    listed = (ROOT / "ab_interfaces/resource/rosidl_interfaces" / NAME).read_text().split()
    assert listed == [str(path) for path in definitions]
