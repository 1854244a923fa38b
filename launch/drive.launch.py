"""A drive, the profile controller and the recorder: `ros2 launch ab_sim drive.launch.py`."""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

NODES = ("drive_sim", "profile_controller", "recorder")


def generate_launch_description() -> LaunchDescription:
    """Three nodes with the parameter files of the package; the scene may be chosen."""
    config = Path(get_package_share_directory("ab_sim"), "config", "nodes")
    scene = LaunchConfiguration("scene")
    chosen = {"drive_sim": {"scene": scene}, "profile_controller": {"profile": scene}}
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "scene",
                default_value="thesis-hold",
                description="name of a scene (`ab-sim scenes`) or path of a YAML file",
            ),
            *(
                Node(
                    package="ab_sim",
                    executable=name,
                    parameters=[str(config / f"{name}.yaml"), chosen.get(name, {})],
                    output="screen",
                )
                for name in NODES
            ),
        ]
    )
