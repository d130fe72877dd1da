"""Runs the examples of all docstrings and of the README, and checks that everything public has a docstring."""

import doctest
import inspect
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import vocc

FOLDER = Path(__file__).parents[1]


def documented() -> Iterator[tuple[str, object]]:
    for name in vocc.__all__:
        thing = getattr(vocc, name)
        if name == "__version__":
            continue
        yield name, thing
        if inspect.isclass(thing):
            for member in vars(thing):
                if not member.startswith("_"):
                    yield f"{name}.{member}", getattr(thing, member)


THINGS = dict(documented())


@pytest.mark.parametrize("name", THINGS)
def test_all_is_documented_and_examples_are_true(name: str) -> None:
    text = THINGS[name].__doc__
    assert text and text.strip(), name
    examples = doctest.DocTestParser().get_doctest(text, {}, name, None, 0)
    outcome = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE).run(examples)
    assert outcome.failed == 0


def test_every_function_and_every_class_that_is_made_has_an_example() -> None:
    made = [name for name in vocc.__all__ if inspect.isfunction(getattr(vocc, name)) or inspect.isbuiltin(getattr(vocc, name))]
    made += ["Camera", "Receiver", "Renderer", "Scene", "Table"]
    assert len(made) >= 13
    for name in made:
        assert ">>> " in (getattr(vocc, name).__doc__ or ""), name


def test_the_readme_s_examples_are_true() -> None:
    text = (FOLDER / "README.md").read_text()
    blocks = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    assert len(blocks) >= 3
    for block in blocks:
        exec(compile(block, "README.md", "exec"), {"__name__": "readme"})
