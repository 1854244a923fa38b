"""Parts of a page: tables, numbers, sentences."""

from typing import Any


def conditions(report: dict[str, Any]) -> str:
    """Return the date and machine of a report."""
    machine, versions = report["machine"], report["versions"]
    load = ", ".join(f"{value:.1f}" for value in machine["load_average"])
    known = ", ".join(f"{name} {version}" for name, version in versions.items())
    return (
        f"{report['date'][:16]} UTC, {machine['processor']}, {machine['cores']} cores, "
        f"load {load}; "
        f"{known}; {report['clock']}, {report['repeats']} interleaved repeats"
    )


def table(head: list[str], rows: list[list[str]]) -> str:
    """Return a table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def folded(title: str, rows: str) -> str:
    """Return a folded table with a title."""
    return f"<details><summary>{title}</summary>\n\n{rows}\n\n</details>"


def sentence(parts: list[str]) -> str:
    """Join parts to a sentence with a capital letter."""
    text = "; ".join(parts)
    return text[0].upper() + text[1:] + "."


def spread(value: dict[str, float], scale: float = 1.0, digits: int = 3) -> str:
    """Return median and quartiles as text."""
    numbers = [scale * value[key] for key in ("lower", "median", "upper")]
    low, median, high = (f"{x:,.0f}" if x >= 1000 else f"{x:.{digits}g}" for x in numbers)
    return f"{median} ({low} to {high})"


def error(value: dict[str, Any]) -> str:
    """Return an error as text, or a bound if the reference is not more accurate."""
    return ("at most " if value["at_most"] else "") + f"{value['value']:.1e}"
