"""`ab-sim view`: finished and growing recordings in Rerun's viewer."""

from ab_sim.base import interruption
from ab_sim.base.errors import AbSimError, InputError
from ab_sim.base.files import RECORDING, check_ending, check_regular
from ab_sim.cli.outputs import results
from ab_sim.cli.scene_commands import ViewOptions
from ab_sim.show.viewing import NATIVE, SHOWING, STARTED, WEB, Viewer, check_view

MEMORY = "50%"
"""Memory limit of the viewer, in percent of this machine's memory: enough to show long recordings
completely."""


def run_view(options: ViewOptions) -> None:
    """Show recordings until Ctrl-C, or until the window is closed.

    Raises
    ------
    InputError
        A file is missing, there is no screen, or the port is in use.
    AbSimError
        The viewer has failed.
    """
    for file in options.files:
        check_ending(file, RECORDING, "FILE")
        try:
            check_regular(file)
        except OSError as error:
            raise InputError(f"{file}: {error.strerror}") from error
    view = WEB if options.web else NATIVE
    if not options.web:
        try:
            check_view(view, screen=True)
        except InputError as error:
            raise InputError(f"{error}: --web") from error
    with interruption.in_order() as stopping:
        viewer = Viewer(view, options.port, MEMORY)
        try:
            for file in options.files:
                viewer.feed(file)
            while viewer.state == STARTED and not stopping.wait(0.02):
                pass
            if viewer.state == SHOWING:
                results.print(f"watch at {viewer.address}   (Ctrl-C ends it)", soft_wrap=True)
            while not viewer.gone and not stopping.wait(0.1):
                pass
            if viewer.gone and not viewer.closed_by_user:
                raise AbSimError(f"the viewer {viewer.state}")
        finally:
            viewer.close()
