"""The package keeps the measures of its structure, and `tools/house.py` measures them rightly."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def tool() -> ModuleType:
    spec = importlib.util.spec_from_file_location("house", ROOT / "tools" / "house.py")
    found = sys.modules["house"] = importlib.util.module_from_spec(spec)  # dataclasses look their module up
    spec.loader.exec_module(found)
    return found


def test_no_file_has_more_lines_than_one_subject_takes(tool: ModuleType) -> None:
    modules = tool.House.at(ROOT).modules.values()
    assert modules and [(one.name, one.lines) for one in modules if one.lines > tool.LONG_FILE] == []


def test_nothing_leans_on_what_is_above_it_or_in_circles(tool: ModuleType) -> None:
    house = tool.House.at(ROOT)
    assert house.upward() == [] and house.circles() == []


def test_every_room_of_a_floor_exists(tool: ModuleType) -> None:
    rooms = {module.room for module in tool.House.at(ROOT).modules.values()}
    assert [room for floor in tool.FLOORS for room in floor if room not in rooms] == []


def test_bare_methods_are_those_that_no_interface_explains(tool: ModuleType) -> None:
    text = '''
class Shape(Protocol):
    size: float

    def area(self):
        """How large it is."""

class Base:
    """A base."""

    def told(self):
        """Something."""

class Child(Base):
    """What extends it."""

    def told(self): ...
    def area(self): ...
    def size(self): ...
    def own(self): ...
    def _hidden(self): ...
'''
    house = tool.House({"rgspipe.a": tool.Module("rgspipe.a", text)})
    assert house.bare() == ["rgspipe.a.Shape", "rgspipe.a.Child.own"]


def test_no_class_has_the_name_of_another(tool: ModuleType) -> None:
    assert tool.House.at(ROOT).twins() == []


def test_twins_are_public_classes_of_one_name(tool: ModuleType) -> None:
    texts = {"rgspipe.a": "class One: ...\nclass _Two: ...", "rgspipe.b": "class One: ...\nclass _Two: ..."}
    house = tool.House({name: tool.Module(name, text) for name, text in texts.items()})
    assert house.twins() == ["One: rgspipe.a, rgspipe.b"]
