"""Commands that need ROS 2 say so, where it is missing."""

from ab_sim.errors import InputError


def require_ros(purpose: str) -> None:
    """Refuse to go on without ROS 2.

    Args:
        purpose: what it is needed for, as "to replay".

    Raises:
        InputError: says how to get it.
    """
    try:
        import rclpy  # noqa: F401
    except ImportError as error:
        raise InputError(
            f"ROS 2 is needed {purpose}, and rclpy cannot be imported ({error}); "
            "install it with `pip install 'ab_sim[ros]'`, or source your ROS 2 installation"
        ) from error
