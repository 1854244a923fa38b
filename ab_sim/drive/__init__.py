"""One running drive, its samples, observations and description.

``Drive`` is imported on first use: it needs the compiler, which modules that only read samples,
such as a recorder, do not wait for.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ab_sim.drive.drive import Drive
else:

    def __getattr__(name: str) -> Any:
        if name != "Drive":
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        from ab_sim.drive.drive import Drive

        return Drive


__all__ = ["Drive"]
