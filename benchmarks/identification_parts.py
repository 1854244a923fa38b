"""Parts of docs/identification.md that other benchmarks than identification.py write."""

from typing import Any

from page_parts import table


def knowledge(report: dict[str, Any]) -> list[str]:
    """Of identification_knowledge.py."""
    rows = [
        [each["case"], ", ".join(_short(name) for name in each["fit"]), _unknown(each["unknown"]),
         f"{each['right']} of {len(each['drives'])}"]
        for each in report["cases"]
    ]  # fmt: skip
    drives = [drive for each in report["cases"] for drive in each["drives"]]
    missed = sum(len(drive["not_named"]) > 0 for drive in drives)
    wrong = sum(len(drive["wrongly"]) > 0 for drive in drives)
    right = sum(each["right"] for each in report["cases"])
    return [
        "## What cannot be known",
        "Written by `python benchmarks/identification_knowledge.py`, from "
        f"`identification-knowledge.json` of {report['conditions']['date'][:16]} UTC. For each "
        "case theory says which changes of the numbers leave the recordings as they are; random "
        "drives are asked as `identify` asks. Right: as many directions as theory has, all numbers "
        "in them named, and no other.",
        table(["recorded", "asked for", "cannot be known", "right"], rows),
        f"{right} of {len(drives)} right: something is not named in {missed}, and something is "
        f"named wrongly in {wrong}.",
    ]  # fmt: skip


def _short(key: str) -> str:
    """The end of a key that is enough to tell it."""
    return ".".join(key.split(".")[-2:]) if key.startswith("effects.") else key


def _unknown(directions: list[list[str]]) -> str:
    if not directions:
        return "-"
    return "; ".join(" with ".join(_short(name) for name in each) for each in directions)
