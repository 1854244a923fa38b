"""One running drive, and what it shows: samples, observations, a description.

``Drive`` itself is imported when it is first asked for: it needs the compiler, which what only
reads samples, as a recorder does, need not wait for.
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
