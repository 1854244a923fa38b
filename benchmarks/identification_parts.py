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


def faults(report: dict[str, Any]) -> list[str]:
    """Of identification_faults.py."""
    cases = report["cases"]
    rows = [
        [each["fault"] or "none", each["read"], each["outcome"], *_told(each)] for each in cases
    ]
    counts = {
        kind: sum(each["outcome"] == kind for each in cases)
        for kind in ("identified", "refused", "flagged", "wrong")
    }
    return [
        "## A drive that breaks while it is recorded",
        "Written by `python benchmarks/identification_faults.py`, from "
        f"`identification-faults.json` of {report['conditions']['date'][:16]} UTC. Nodes ran as "
        f"processes, the faults came {report['at']:g} s after the start, and the live recorder's "
        "recording or bag was identified, which shows the drive as it is; or what the sensors said "
        "in their messages. The fit also had a sound recording without balls. No note of the "
        "recorder was needed for what is told here; where it noted a fault, its text and time are "
        "among the notes.",
        table(["fault", "read from", "outcome", "verdict", "sign"], rows),
        ", ".join(f"{kind} {count}" for kind, count in counts.items())
        + ". Wrong would be a value more than six of its own standard deviations off, and the "
        "verdict that it fits.",
    ]


def _told(case: dict[str, Any]) -> tuple[str, str]:
    """The verdict, and what is said of the fault itself."""
    says = [text.partition(": ")[2] if ": " in text else text for text in case["says"]]
    if case["outcome"] == "refused":
        return "-", says[0]
    known = ("fits until", "drifts by", "would explain it", "times the fitted ones")
    signs = [text for text in says if any(word in text for word in known)]
    if case["outcome"] == "identified":
        most = max(abs(each) for each in case["deviations_off"].values())
        return case["verdict"], f"all values within {most:.2g} standard deviations"
    return case["verdict"], "; ".join(signs) or "none"


def _short(key: str) -> str:
    """The end of a key that is enough to tell it."""
    return ".".join(key.split(".")[-2:]) if key.startswith("effects.") else key


def _unknown(directions: list[list[str]]) -> str:
    if not directions:
        return "-"
    return "; ".join(" with ".join(_short(name) for name in each) for each in directions)
