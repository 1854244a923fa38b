"""Parts of docs/identification.md that benchmarks other than identification.py write."""

from typing import Any

from page_parts import table

GAINS = {"gain of bare": "gain without balls", "gain of with": "gain with balls"}
"""Names of the gains of the two recordings on the page."""


def knowledge(report: dict[str, Any]) -> list[str]:
    """Return the part on identification_knowledge.py."""
    unknown: dict[str, list[str]] = {}
    for each in report["cases"]:
        unknown.setdefault(_unknown(each["unknown"]), []).append(each["case"])
    known = unknown.pop("-", [])
    rows = [["; ".join(cases), values] for values, cases in unknown.items()]
    drives = [drive for each in report["cases"] for drive in each["drives"]]
    right = sum(each["right"] for each in report["cases"])
    return [
        "## Parameters that recordings do not determine",
        "Some recordings do not determine all fitted parameters. Parameters joined by + can change "
        "together without changing the recordings.",
        table(["recorded", "not determined"], rows),
        f"These recordings determine all fitted parameters: {'; '.join(known)}.",
        f"`identify` named the same values as theory for {right} of {len(drives)} random drives "
        "(`python benchmarks/identification_knowledge.py`, "
        "[identification-knowledge.json](identification-knowledge.json), "
        f"{report['conditions']['date'][:10]}).",
    ]  # fmt: skip


def faults(report: dict[str, Any]) -> list[str]:
    """Return the part on identification_faults.py."""
    cases = report["cases"]
    rows = [[each["fault"] or "none", each["read"], each["outcome"], _told(each)] for each in cases]
    wrong = sum(each["outcome"] == "wrong" for each in cases)
    return [
        "## A drive that breaks while it is recorded",
        f"Faults were injected {report['at']:g} s after the start of a live drive. A recording or "
        "bag shows the drive itself; messages show what its sensors report "
        "(`python benchmarks/identification_faults.py`, "
        "[identification-faults.json](identification-faults.json), "
        f"{report['conditions']['date'][:10]}).",
        table(["fault", "read from", "outcome", "report"], rows),
        f"{wrong} of {len(cases)} outcomes were wrong: the verdict *fits* with a value more than "
        "six standard deviations off.",
    ]


def _told(case: dict[str, Any]) -> str:
    """Return the report's text on the fault, up to its advice."""
    says = [text.partition(": ")[2] if ": " in text else text for text in case["says"]]
    if case["outcome"] == "refused":
        return says[0].partition("; ")[0]
    if case["outcome"] == "identified":
        most = max(abs(each) for each in case["deviations_off"].values())
        return f"fits; all values within {most:.2g} standard deviations"
    known = ("fits until", "drifts by", "would explain the residuals", "times the fitted ones")
    signs = [text.partition(": ")[0] for text in says if any(word in text for word in known)]
    return "; ".join(signs) or "none"


def _short(key: str) -> str:
    """Return the end of a key that is enough to tell it; the name of a gain."""
    if key in GAINS:
        return GAINS[key]
    return ".".join(key.split(".")[-2:]) if key.startswith("effects.") else key


def _unknown(directions: list[list[str]]) -> str:
    if not directions:
        return "-"
    return "; ".join(" + ".join(_short(name) for name in each) for each in directions)
