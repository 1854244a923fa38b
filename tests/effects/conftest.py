"""Lets assertions in the effects' specifications, which are no test files, explain themselves."""

from pathlib import Path

import pytest

pytest.register_assert_rewrite(
    *(
        f"tests.effects.{file.stem}"
        for file in Path(__file__).parent.glob("[a-z]*.py")
        if file.stem != "conftest"
    )
)
