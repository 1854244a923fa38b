"""Start two drives on one domain, in the namespaces left and right.

ros2 launch ab_sim two_drives.launch.py left:=balanced-start-up right:=thesis-hold
"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, GroupAction, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration

SIDES = {"left": "balanced-start-up", "right": "thesis-hold"}


def generate_launch_description() -> LaunchDescription:
    """Include ``startup.launch.py`` twice; when one drive exits, everything shuts down."""
    declared = [
        DeclareLaunchArgument(side, default_value=scene, description="scene of this drive")
        for side, scene in SIDES.items()
    ]
    return LaunchDescription([*declared, *map(_side, SIDES)])


def _side(side: str) -> GroupAction:
    file = Path(get_package_share_directory("ab_sim"), "launch", "startup.launch.py")
    arguments = {"namespace": side, "scene": LaunchConfiguration(side)}
    start_up = IncludeLaunchDescription(
        PythonLaunchDescriptionSource(str(file)), launch_arguments=arguments.items()
    )
    # The group limits the scope of the arguments to one side.
    return GroupAction([start_up])
