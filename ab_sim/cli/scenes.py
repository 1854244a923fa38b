"""`ab-sim scenes`."""

import re
from pathlib import Path

from rich.table import Table
from rich.text import Text

from ab_sim.cli.outputs import PlainConsole
from ab_sim.cli.own_command import own_command
from ab_sim.scene_files import find_scene, read_scene_file, scene_names

console = PlainConsole()


def print_scenes() -> None:
    """Print a line for each scene in the package: name and beginning of the description."""
    names = scene_names()
    widest = max(map(len, names))
    for name in names:
        first, *_ = re.split(r"(?<=\.)\s", _text(find_scene(name), "description"), maxsplit=1)
        line = Text(f"{name:{widest}}  {first}")
        if console.is_terminal:
            console.print(line, no_wrap=True, overflow="ellipsis")
        else:  # another program reads it
            console.print(line, soft_wrap=True)


def print_scene(name: str) -> None:
    """Print the description of a scene's file.

    Raises:
        SceneError: there is no such scene, or it cannot be read.
    """
    from ab_sim.scene import load_scene

    file = find_scene(name)
    scene = load_scene(file)
    table = Table(show_header=False)
    table.add_row("file", str(file))
    table.add_row("what it is", scene.description)
    table.add_row("source", scene.source)
    table.add_row("balls", str(scene.balls.count))
    table.add_row("effects", ", ".join(scene.effects) or "none")
    for assumption in scene.assumed:
        table.add_row("assumed", assumption)
    console.print(table)
    console.print(f"to see what is simulated: {own_command()} check {name}")


def _text(file: Path, key: str) -> str:
    return " ".join(str(read_scene_file(file).get(key, "")).split())
