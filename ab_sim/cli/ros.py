"""Check for ROS 2 in commands that need it."""

from ab_sim.errors import InputError


def require_ros(purpose: str) -> None:
    """Refuse to continue without ROS 2.

    Args:
        purpose: purpose of ROS 2, such as "to replay".

    Raises:
        InputError: ROS 2 is missing; the message tells how to install it.
    """
    try:
        import rclpy  # noqa: F401
    except ImportError as error:
        raise InputError(
            f"ROS 2 is needed {purpose}, and rclpy cannot be imported ({error}); "
            "install it with `pip install 'ab_sim[ros]'`, or source your ROS 2 installation"
        ) from error
