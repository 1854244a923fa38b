"""Write the parts of documentation pages that follow from the code.

    .venv/bin/python docs/extensions/from_code.py

A part stands between the comments `<!-- from code: NAME -->` and `<!-- to here -->`. Those of
``AT_BUILD`` depend on the checkout or on Sphinx, and are filled in when the site is built.
"""

import re
import sys
from collections.abc import Callable, Iterable, Iterator
from inspect import cleandoc, getdoc
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args, get_type_hints

import yaml
from gallery_scripts import examples
from laws import LAWS
from pydantic import BaseModel

if TYPE_CHECKING:
    from sphinx.application import Sphinx

ROOT = Path(__file__).absolute().parents[2]
_PART = re.compile(
    r"^<!-- from code: ([a-z-]+) -->$(?:(?:\n(?!<!-- from code).*)*?\n<!-- to here -->$)?",
    re.MULTILINE,
)

Schema = dict[str, Any]

SECTIONS = (
    "rotor", "race", "balls", "start", "spindle", "profile", "solver", "accuracy", "deck", "mounts",
    "balanced",
)  # fmt: skip
"""Sections of a scene in the order of the page; effects and sensors have their own pages."""

WORDS = {
    "name": "of the scene; one line",
    "description": "what the scene is; `ab-sim scenes NAME` prints it",
    "source": "where its numbers are from",
    "assumed": "what the source does not say and the scene assumes, one text each",
    "effects": "what acts; a list of names, each with its parameters: [effects](effects.md)",
    "sensors": "accelerometers, each by its name: [sensors](sensors.md)",
    "kind": "which profile it is",
    "segments": "one after the other, [below](#profile-segments)",
}
"""Meanings of keys that have none in the code."""


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|").replace("<", "&lt;")


def _table(head: list[str], rows: list[list[str]]) -> list[str]:
    lines = [head, ["---"] * len(head), *rows]
    return ["| " + " | ".join(line) + " |" for line in lines] + [""]


def _number(value: Any) -> str:
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_number, value))}]"
    return f"{value:g}" if isinstance(value, int | float) else f"`{value}`"


def _leaves(field: Schema, definitions: Schema) -> Iterator[Schema]:
    """Yield the schemas of a value's possible types, without unions, references and None."""
    if "$ref" in field:
        yield definitions[field["$ref"].rpartition("/")[2]]
        return
    options = field.get("anyOf") or field.get("oneOf") or [field]
    if options == [field]:
        if field.get("type") != "null":
            yield field
        return
    for option in options:
        yield from _leaves(option, definitions)


def _elements(leaf: Schema) -> Schema:
    if leaf.get("type") != "array":
        return leaf
    items = leaf.get("items") or (leaf.get("prefixItems") or [{}])[0]
    return items if isinstance(items, dict) else {}


def _bounds(annotation: Any) -> Schema:
    """Return the bounds of the first number in a type; the JSON schema omits those of a union."""
    found: Schema = {}
    for extra in getattr(annotation, "__metadata__", ()):
        for bound in getattr(extra, "metadata", (extra,)):
            found |= _bound(bound)
    for inner in get_args(annotation):
        found = found or _bounds(inner)
    return found


def _bound(metadata: Any) -> Schema:
    names = {"ge": "minimum", "gt": "exclusiveMinimum", "le": "maximum"}
    return {
        word: value
        for name, word in names.items()
        if (value := getattr(metadata, name, None)) is not None
    }


def _with_bounds(schema: Schema, models: Iterable[type[BaseModel]]) -> None:
    """Add the missing bounds to the schemas of these models and of the models in their fields."""
    for model in models:
        of = schema["$defs"].get(model.__name__, schema)
        inner = []
        for name, field in model.model_fields.items():
            found: Schema = {}
            for metadata in field.metadata:
                found |= _bound(metadata)
            of["properties"][name] |= found or _bounds(field.annotation)
            inner += _models(field.annotation)
        _with_bounds(schema, inner)


def _models(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for inner in get_args(annotation) for model in _models(inner)]


def _range(field: Schema, definitions: Schema) -> str:
    for leaf in (field, *map(_elements, _leaves(field, definitions))):
        for known in [leaf] if leaf is field else _leaves(leaf, definitions):
            if "enum" in known:
                return " or ".join(f"`{value}`" for value in known["enum"])
            if "const" in known:
                return f"`{known['const']}`"
            low, high = known.get("minimum"), known.get("maximum")
            above = known.get("exclusiveMinimum")
            if low is not None and high is not None:
                return f"{low:g} to {high:g}"
            parts = [f"above {above:g}"] if above is not None else []
            parts += [f"from {low:g}"] if low is not None else []
            parts += [f"up to {high:g}"] if high is not None else []
            if parts:
                return ", ".join(parts)
    return ""


def _kind(field: Schema, definitions: Schema) -> str:
    words = []
    for leaf in _leaves(field, definitions):
        kind = leaf.get("type", "")
        if kind == "array":
            inner = next(_leaves(_elements(leaf), definitions), {})
            what = {"string": "texts", "object": "sections"}.get(inner.get("type", ""), "numbers")
            count = leaf.get("minItems")
            fixed = count is not None and count == leaf.get("maxItems")
            word = f"list of {count} {what}" if fixed else f"list of {what}"
        elif "additionalProperties" in leaf and "properties" not in leaf:
            each = leaf["additionalProperties"]
            plain = isinstance(each, dict) and each.get("type") == "number"
            word = "numbers by name" if plain else "sections by name"
        else:
            word = {"number": "number", "integer": "whole number", "string": "text"}.get(
                kind, "section"
            )
        if word not in words:
            words.append(word)
    return " or ".join(words)


def _rows(section: Schema, definitions: Schema, at: str) -> list[list[str]]:
    rows = []
    required = section.get("required", [])
    for name, field in section["properties"].items():
        leaves = list(_leaves(field, definitions))
        inner = leaves[0] if leaves else {}
        meaning = field.get("description") or WORDS.get(name, "")
        if not meaning and "properties" in inner:
            meaning = cleandoc(inner.get("description", "")).partition("\n\n")[0]
        default = field.get("default")
        shown = "**required**" if name in required else ""
        if default is not None and not isinstance(default, dict):
            shown = _number(default) if default not in ("", []) else "empty"
        rows.append(
            [
                f"`{at}{name}`",
                _cell(meaning),
                _kind(field, definitions),
                field.get("unit", ""),
                _range(field, definitions),
                shown,
            ]
        )
    return rows


KEYS = ["key", "meaning", "type", "unit", "range", "default"]


def _section(head: str, at: str, schema: Schema, definitions: Schema, depth: int) -> list[str]:
    words = cleandoc(schema.get("description", ""))
    lines = [f"{'#' * depth} {head}", "", _plain(words), ""]
    lines += _table(KEYS, _rows(schema, definitions, at))
    for name, field in schema["properties"].items():
        for leaf in _leaves(field, definitions):
            inner = next(_leaves(_elements(leaf), definitions), {})
            if "properties" in inner:
                many = "N." if leaf.get("type") == "array" else ""
                key = f"{at}{name}"
                lines += _section(key, f"{key}.{many}", inner, definitions, depth + 1)
    return lines


def _plain(text: str) -> str:
    """A docstring as Markdown: its marks for code are those of reStructuredText."""
    text = text.replace("``", "`").replace("<", "\\<")
    return re.sub(r"(?<![`\w/])docs/([a-z-]+)\.md", r"[docs/\1.md](../\1.md)", text)


def scene_keys() -> Iterator[str]:
    """Every key of a scene, by section."""
    from ab_sim.scene import Scene

    schema = Scene.model_json_schema()
    _with_bounds(schema, [Scene])
    definitions = schema["$defs"]
    top = {key: field for key, field in schema["properties"].items() if key not in SECTIONS}
    yield from ["## The top level", ""]
    yield from _table(KEYS, _rows({**schema, "properties": top}, definitions, ""))
    for name in SECTIONS:
        field = schema["properties"][name]
        required = "" if name in schema["required"] else " (optional)"
        leaves = [
            inner
            for leaf in _leaves(field, definitions)
            for inner in _leaves(_elements(leaf), definitions)
        ]
        if len(leaves) == 1:
            many = "N." if name == "mounts" else ""
            yield from _section(name + required, f"{name}.{many}", leaves[0], definitions, 2)
            continue
        yield from [f"## {name}{required}", "", "One of the following; `kind` selects it.", ""]
        for leaf in leaves:
            kind = leaf["properties"]["kind"]["const"]
            yield from _section(f"{name}: {kind}", f"{name}.", leaf, definitions, 3)


def effects() -> Iterator[str]:
    """Yield meaning, equation, source, parameters and formulas of each effect."""
    from ab_sim.export.formulas.effects import formulas_of
    from ab_sim.export.formulas.page import typeset
    from ab_sim.scene.registry import effect_classes, effect_parameters

    for name, effect in effect_classes().items():
        yield from [f"## {name}", "", _plain(cleandoc(effect.__doc__ or "")), ""]
        types = get_type_hints(effect, include_extras=True)
        fields = {
            key: {**field, **_bounds(types[key])}
            for key, field in effect_parameters(effect).items()
        }
        yield from _parameters(effect, fields, f"effects.{name}.")
        if effect.uses_ball_radius:
            yield from ["The effect also requires `balls.radius`.", ""]
        yield from ["<details><summary>Formulas in the code</summary>", ""]
        for formula in formulas_of(effect):
            said = f": {_cell(formula.meaning)}" if formula.meaning else ""
            yield from [f"`{formula.method}`{said}", ""]
            if formula.trouble:
                yield from [f"cannot be printed: {formula.trouble}", ""]
            else:
                yield from typeset(formula.lines)
        yield from ["</details>", ""]


def sensors() -> Iterator[str]:
    """Yield the page parts of the accelerometer and the proximity probe."""
    from ab_sim.scene.sensors import Accelerometer, ProximityProbe

    kinds = (
        ("accelerometer", Accelerometer, "sensors.NAME."),
        ("proximity probe", ProximityProbe, "probes.NAME."),
    )
    for title, kind, key in kinds:
        yield from [f"## {title}", "", _plain(cleandoc(kind.__doc__ or "")), ""]
        yield from _parameters(kind, kind.model_json_schema()["properties"], key)


def _parameters(what: type[Any], fields: dict[str, Schema], at: str) -> Iterator[str]:
    shown = LAWS.get(what.equation)
    yield from [shown] if shown else ["~~~text", what.equation, "~~~"]
    yield from ["", f"Source: {_plain(what.source)}", ""]
    schema = {
        "properties": fields,
        "required": [name for name, field in fields.items() if "default" not in field],
    }
    if fields:
        yield from _table(KEYS, _rows(schema, {}, at))
    else:
        yield from ["No parameters.", ""]


def metrics() -> Iterator[str]:
    """Every metric of a run, by its key."""
    from ab_sim.analysis.metrics import described_metrics

    rows = []
    for each in described_metrics():
        shown = [each.unit.replace("-", ""), each.better, each.taken_by, _cell(each.meaning)]
        rows.append([f"`{each.name}`", *shown, f"`{each.equation}`" if each.equation else ""])
    yield from _table(["key", "unit", "better", "taken by", "meaning", "equation"], rows)


def commands() -> Iterator[str]:
    """Every command's help, from the parser."""
    from typer.main import get_command

    from ab_sim.cli.app import app

    yield from _command(get_command(app), "ab-sim", None)


def _command(command: Any, path: str, parent: Any) -> Iterator[str]:
    context = command.context_class(command, info_name=path.split()[-1], parent=parent)
    inner = getattr(command, "commands", {})
    if parent is not None:
        yield from [f"## {path}", ""]
    usage = " ".join(command.collect_usage_pieces(context))
    yield from ["```text", f"{path} {usage}", "```", ""]
    yield from [_plain(cleandoc(command.help or "")), ""]
    rows = []
    for parameter in command.get_params(context):
        record = parameter.get_help_record(context)
        if record is None:
            name = f"`{parameter.make_metavar(context)}`"
            rows.append([name, _cell(getattr(parameter, "help", None) or "")])
        elif parameter.name != "help":
            rows.append([f"`{record[0]}`".replace("|", "\\|"), _cell(record[1])])
    if rows:
        yield from _table(["argument or option", "meaning"], rows)
    for name, each in inner.items():
        yield from _command(each, f"{path} {name}", context)


def node_parameters() -> Iterator[str]:
    """Every parameter of the nodes, from the files in config/nodes."""
    for file in sorted((ROOT / "config" / "nodes").glob("*.yaml")):
        text = file.read_text(encoding="utf-8")
        values = yaml.safe_load(text)["/**"]["ros__parameters"]
        said = dict(re.findall(r"^    (\w+):.*?\s# (.*)$", text, re.MULTILINE))
        yield from [f"## {file.stem}", ""]
        rows = [
            [f"`{name}`", f"`{value!r}`" if value != "" else "empty", _cell(said.get(name, ""))]
            for name, value in values.items()
        ]
        yield from _table(["parameter", "default", "meaning"], rows)


def topics() -> Iterator[str]:
    """Every topic of the contract."""
    from ab_msgs_py.topics import table

    yield from [*table(), ""]


def scenes() -> Iterator[str]:
    """Every scene of the package, and how its description begins."""
    from ab_sim.base.yaml_files import find_scene, read_scene_file, scene_names

    rows = []
    for name in scene_names():
        words = " ".join(str(read_scene_file(find_scene(name)).get("description", "")).split())
        rows.append([f"`{name}`", _cell(re.split(r"(?<=\.)\s", words, maxsplit=1)[0])])
    yield from _table(["scene", "description"], rows)


def python() -> Iterator[str]:
    """Every public name of the package, with the first line of its docstring."""
    import ab_sim

    rows = []
    for name in ab_sim.__all__:
        value = getattr(ab_sim, name)
        words = "Version of the package." if isinstance(value, str) else getdoc(value) or ""
        rows.append([f"`ab_sim.{name}`", _cell(_plain(words.partition("\n\n")[0]))])
    yield from _table(["name", "meaning"], rows)


STORED: dict[str, Callable[[], Iterator[str]]] = {
    "scene-keys": scene_keys,
    "effects": effects,
    "sensors": sensors,
    "commands": commands,
    "metrics": metrics,
    "node-parameters": node_parameters,
    "scenes": scenes,
    "topics": topics,
    "python": python,
}
AT_BUILD: dict[str, Callable[[], Iterator[str]]] = {
    "examples": examples,
}


def current(text: str) -> str:
    """Return a page with its stored parts as the code has them now."""

    def part(mark: re.Match[str]) -> str:
        if mark[1] not in STORED:
            return mark[0]
        body = "\n".join(STORED[mark[1]]()).strip("\n")
        return f"<!-- from code: {mark[1]} -->\n\n{body}\n\n<!-- to here -->"

    return _PART.sub(part, text)


def main() -> int:
    """Write all pages; with ``--check`` only report those that are not current."""
    stale = []
    for page in sorted((ROOT / "docs").rglob("*.md")):
        text = page.read_text(encoding="utf-8")
        if "_build" not in page.parts and (new := current(text)) != text:
            stale.append(page.relative_to(ROOT))
            if "--check" not in sys.argv:
                page.write_text(new, encoding="utf-8")
    for name in stale:
        print(f"{name}: not current" if "--check" in sys.argv else name)
    return int("--check" in sys.argv and bool(stale))


def fill_in(app: "Sphinx", docname: str, source: list[str]) -> None:
    """Fill in parts that are not stored in a page, and remove the comments of those that are."""

    def part(mark: re.Match[str]) -> str:
        if mark[1] in AT_BUILD:
            return "\n".join(AT_BUILD[mark[1]]())
        return "\n".join(mark[0].splitlines()[1:-1])

    source[0] = _PART.sub(part, source[0])


def setup(app: "Sphinx") -> dict[str, bool]:
    """Connect to Sphinx, before links are changed."""
    app.connect("source-read", fill_in, priority=100)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


if __name__ == "__main__":
    sys.path.insert(0, str(ROOT))
    sys.exit(main())
