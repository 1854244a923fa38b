"""A simulated drive whose speed a velocity controller of ros2_control commands.

ros2 launch examples/ros2_control/drive.launch.py scene:=thesis-hold
"""

import subprocess
from pathlib import Path

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

CONTROLLERS = str(Path(__file__).with_name("controllers.yaml"))


def generate_launch_description() -> LaunchDescription:
    """Start the drive, the controller manager with its topic hardware, and two controllers."""
    scene = DeclareLaunchArgument("scene", default_value="thesis-hold", description="scene")
    return LaunchDescription([scene, OpaqueFunction(function=_nodes)])


def _nodes(context: LaunchContext) -> list[Node]:
    scene = LaunchConfiguration("scene").perform(context)
    urdf = subprocess.run(
        ["ab-sim", "urdf", scene, "--ros2-control"], check=True, capture_output=True, text=True
    ).stdout
    loaded = ["joint_state_broadcaster", "velocity_controller", "--param-file", CONTROLLERS]
    # The drive is last: if a package is missing, launch leaves running what it has started before.
    return [
        Node(
            package="robot_state_publisher",
            executable="robot_state_publisher",
            parameters=[{"robot_description": urdf, "use_sim_time": True}],
        ),
        Node(
            package="controller_manager",
            executable="ros2_control_node",
            parameters=[CONTROLLERS],
        ),
        Node(package="controller_manager", executable="spawner", arguments=loaded),
        Node(package="ab_sim", executable="drive_sim", parameters=[{"scene": scene}]),
    ]
