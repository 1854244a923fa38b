"""Functions are made once for what their code depends on, and called where they are."""

from collections.abc import Callable, Mapping
from types import FunctionType
from typing import Any, NamedTuple

import pytest

from ab_sim.engine.compiling import Compiled, Library, Untranslatable
from ab_sim.engine.compiling.library import Module


class Choice(NamedTuple):
    squared: bool
    shifted: bool


def short(x: float) -> float:
    return 2.0 * x


def long(x: float) -> float:
    """It reads no field, and is too long to be put in the place of its calls."""
    total = 0.0
    for k in range(20):
        part = short(x) / (k + 1.0)
        if part > 1.0:
            total += 1.0 / part
        elif part < -1.0:
            total -= 1.0 / part
        elif part > 0.5 or part < -0.5:
            total += part * part
        else:
            total = total - part
        if total == 7.0:
            total = 0.0
        if total < -100.0 or total > 100.0:
            total = total / 3.0
    return total


def chosen(choice: Choice, x: float) -> float:
    found = long(x) if choice.squared else x
    for k in range(5):
        found += long(found / (k + 1.0))
        if found > 100.0:
            found -= 10.0
        elif found < -100.0:
            found += 10.0
        if found > 50.0 and found * found > 3000.0:
            found *= 0.5
        if k == 3 and found < 0.0:
            found = found + 0.25 * found
    return found * found if choice.squared else found


def one(choice: Choice, x: float) -> float:
    return chosen(choice, x) + short(x)


def other(choice: Choice, x: float) -> float:
    return chosen(choice, x) - (short(x) if choice.shifted else 0.0)


def wrong(choice: Choice, x: float) -> float:
    return long(x) + len([x])


def new_in(library: Library, function: Callable[..., Any], known: Mapping[str, bool]) -> set[str]:
    """Names of the functions that would have to be made."""
    assert isinstance(function, FunctionType)
    return {each.__name__ for each in Module(function, known, library).new}


NEITHER = {"squared": False, "shifted": False}


def test_what_has_been_made_is_called_where_it_is() -> None:
    library, choice = Library(), Choice(False, True)
    assert new_in(library, one, {}) == {"one", "chosen", "long", "short"}
    assert Compiled(one, library=library)(choice, 1.5) == one(choice, 1.5)
    assert new_in(library, one, {}) == set()
    assert new_in(library, other, {}) == {"other"}
    text = Module(other, {}, library).text()  # type: ignore[arg-type]
    declared = [line for line in text.splitlines() if line.startswith("declare") and "@" in line]
    assert any("test_library.chosen" in line for line in declared)
    assert "test_library.long" not in text, "only what has been made calls it"
    assert "define internal double" in text, "of short ones the text is needed again"
    assert Compiled(other, library=library)(choice, 1.5) == other(choice, 1.5)


@pytest.mark.parametrize(
    ("known", "anew"),
    [
        (NEITHER, set()),
        ({**NEITHER, "shifted": True}, {"other"}),
        ({**NEITHER, "squared": True}, {"other", "chosen"}),
        ({"shifted": False}, {"other", "chosen"}),
        ({**NEITHER, "elsewhere": True}, set()),
    ],
)
def test_code_depends_on_the_fields_that_it_reads_itself_or_by_what_it_calls(
    known: dict[str, bool], anew: set[str]
) -> None:
    library = Library()
    choice = Choice(known.get("squared", False), known.get("shifted", False))
    Compiled(other, NEITHER, library)(Choice(False, False), 0.5)
    assert new_in(library, other, known) == anew
    for x in (-3.0, 0.5, 8.0):
        assert Compiled(other, known, library)(choice, x) == other(choice, x)
    assert new_in(library, other, known) == new_in(library, other, NEITHER) == set()


def test_a_function_that_cannot_be_translated_leaves_nothing_behind() -> None:
    library = Library()
    with pytest.raises(Untranslatable, match=r"test_library.py:\d+: in wrong"):
        Compiled(wrong, library=library)(Choice(True, True), 1.0)
    assert library.size == 0
    assert new_in(library, long, {}) == {"long", "short"}


def test_libraries_have_nothing_in_common() -> None:
    Compiled(long, library=Library())(1.0)
    assert new_in(Library(), long, {}) == {"long", "short"}
