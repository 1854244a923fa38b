"""Start a drive, its profile controller and, on request, the recorder and a viewer.

ros2 launch ab_sim startup.launch.py scene:=balanced-start-up record:=true
"""

from pathlib import Path
from typing import Any

from ament_index_python.packages import get_package_share_directory
from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction, Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from ab_sim.base.yaml_files import read_yaml

SWITCH = ("true", "false")
ARGUMENTS = {
    "scene": ("", "name of a scene (`ab-sim scenes`) or path of a YAML file"),
    "changes": ("", "changes to the scene: balls.mass=0.002, or a YAML list of such"),
    "profile": ("", "profile to run: scene name or YAML file; empty: the scene's profile"),
    "auto_start": ("true", "start the profile as soon as the drive is ready; false: by ~/start"),
    "record": ("false", "true: record the run; implied by path"),
    "headless": ("true", "false: show the run in Rerun's window; does not record by itself"),
    "path": ("", ".rrd file to record to; empty: recordings/<date>_<time>.rrd"),
    "namespace": ("", "namespace of all nodes and of their clock"),
    "params_file": ("", "YAML file of node parameters; launch arguments take precedence"),
}


def generate_launch_description() -> LaunchDescription:
    """Declare arguments; they override ``params_file``, which overrides the package's files."""
    declared = [
        DeclareLaunchArgument(
            name,
            default_value=default,
            description=meaning,
            choices=SWITCH if default in SWITCH else None,
        )
        for name, (default, meaning) in ARGUMENTS.items()
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=_nodes)])


def _nodes(context: LaunchContext) -> list[Node]:
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    scene, path = given["scene"], given["path"]
    drive: dict[str, Any] = _texts(scene=scene)
    if given["changes"]:
        drive["changes"] = _list_of(given["changes"])
    controller = _texts(profile=given["profile"] or scene)
    controller["auto_start"] = given["auto_start"] == "true"
    nodes = [
        _node("drive_sim", given, drive, on_exit=Shutdown()),
        _node("profile_controller", given, controller),
    ]
    kept, watched = bool(path) or given["record"] == "true", given["headless"] == "false"
    if kept or watched:
        recorder = _texts(path=path, view="native" if watched else "")
        # Set `keep` only if it is false, so that a parameter file can still request a bag.
        nodes.append(_node("recorder", given, recorder | ({} if kept else {"keep": False})))
    return nodes


def _node(name: str, given: dict[str, str], parameters: dict[str, Any], **more: Any) -> Node:
    config = Path(get_package_share_directory("ab_sim"), "config", "nodes", f"{name}.yaml")
    namespace, own = given["namespace"], given["params_file"]
    return Node(
        package="ab_sim",
        executable=name,
        name=name,  # so that arguments override a parameter file's entry for this node
        namespace=namespace,
        # The topic's name is absolute, and two drives on one domain need separate clocks.
        remappings=[("/clock", "clock")] if namespace else None,
        parameters=[str(config), *([own] if own else []), *([parameters] if parameters else [])],
        output="screen",
        **more,
    )


def _texts(**given: str) -> dict[str, Any]:
    """Return parameters of type string; empty ones are left to the parameter files."""
    return {name: ParameterValue(text, value_type=str) for name, text in given.items() if text}


def _list_of(changes: str) -> list[str]:
    try:
        read = read_yaml(changes)
    except ValueError as error:
        raise ValueError(f"changes: {error}") from error
    return [str(change) for change in read] if isinstance(read, list) else [changes]
