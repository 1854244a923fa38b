"""Parts of a page: tables, numbers, sentences."""

from typing import Any


def conditions(report: dict[str, Any]) -> str:
    """When and where."""
    machine, versions = report["machine"], report["versions"]
    load = ", ".join(f"{value:.1f}" for value in machine["load_average"])
    known = ", ".join(f"{name} {version}" for name, version in versions.items())
    return (
        f"{report['date'][:16]} UTC, {machine['processor']}, {machine['cores']} cores, "
        f"load {load}; "
        f"{known}; {report['clock']}, {report['repeats']} interleaved repeats"
    )


def table(head: list[str], rows: list[list[str]]) -> str:
    """In Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def folded(title: str, rows: str) -> str:
    """Return a table behind a title that opens it."""
    return f"<details><summary>{title}</summary>\n\n{rows}\n\n</details>"


def sentence(parts: list[str]) -> str:
    """Of parts that begin in lower case."""
    text = "; ".join(parts)
    return text[0].upper() + text[1:] + "."


def spread(value: dict[str, float], scale: float = 1.0, digits: int = 3) -> str:
    """Median and quartiles."""
    numbers = [scale * value[key] for key in ("lower", "median", "upper")]
    low, median, high = (f"{x:,.0f}" if x >= 1000 else f"{x:.{digits}g}" for x in numbers)
    return f"{median} ({low} to {high})"


def error(value: dict[str, Any]) -> str:
    """A bound, where the reference tells no more."""
    return ("at most " if value["at_most"] else "") + f"{value['value']:.1e}"
