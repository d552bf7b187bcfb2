"""Measures of the code as a house: its rooms, how large they are, who leans on whom, what stands twice.

python tools/house.py                 # as it stands
python tools/house.py --since REV     # beside what it was at a commit
"""

from __future__ import annotations

import argparse
import ast
import io
import statistics
import subprocess
import tarfile
import tempfile
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

PACKAGE = "rgspipe"

#: Rooms from the ground up; what stands in one may lean on its own floor and those below it. Modules that stand alone
#: are the ground, unless they are named here.
FLOORS = (
    ("scene", "optim"),
    ("datasets",),
    ("renderer",),
    ("fitting", "completion"),
    ("training",),
    ("capture",),
    ("degradation", "evidence", "blender", "evaluation", "light_export"),
    ("relighting", "studies", "benchmark", "pages", "viewer"),
    ("config",),
    ("stages",),
    ("graph", "demo"),
    ("cluster", "cli"),
    ("__main__",),
)

#: A file that is longer than this has more than one subject, and a block that stands twice this many lines.
LONG_FILE, BLOCK = 300, 6


@dataclass(frozen=True)
class Module:
    """One file of the package."""

    name: str
    text: str

    @cached_property
    def tree(self) -> ast.Module:
        return ast.parse(self.text)

    @property
    def room(self) -> str:
        """The first name below the package."""
        return self.name.split(".")[1] if "." in self.name else self.name

    @property
    def lines(self) -> int:
        return len(self.text.splitlines())

    def functions(self) -> Iterator[ast.FunctionDef]:
        for node in ast.walk(self.tree):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                yield node

    def imports(self) -> Iterator[str]:
        """Modules of the package that it names, but those only for type checkers."""
        skipped = {id(child) for node in ast.walk(self.tree) if _for_types(node) for child in ast.walk(node)}
        for node in ast.walk(self.tree):
            if isinstance(node, ast.ImportFrom) and id(node) not in skipped and (node.module or "").startswith(PACKAGE):
                for name in node.names:
                    yield f"{node.module}.{name.name}"

    def constants(self) -> Iterator[str]:
        """Module-level names in capitals whose values are numbers, or tuples of numbers."""
        for node in self.tree.body:
            if isinstance(node, ast.Assign) and _is_number(node.value):
                for target in node.targets:
                    names = target.elts if isinstance(target, ast.Tuple) else [target]
                    yield from (name.id for name in names if isinstance(name, ast.Name) and name.id.isupper())

    def settings(self) -> Iterator[str]:
        """Fields of classes whose defaults are numbers, or tuples of numbers, bare or in a call of `option`."""
        for owner in self.tree.body:
            for node in owner.body if isinstance(owner, ast.ClassDef) else ():
                if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name) and node.value:
                    value = node.value
                    if isinstance(value, ast.Call) and getattr(value.func, "id", "") == "option" and value.args:
                        value = value.args[0]
                    if _is_number(value):
                        yield f"{owner.name}.{node.target.id}"

    def classes(self) -> Iterator[ast.ClassDef]:
        for node in self.tree.body:
            if isinstance(node, ast.ClassDef):
                yield node

    def significant(self) -> list[tuple[int, str]]:
        """Lines of code with their numbers, without imports, comments, docstrings and lone punctuation."""
        texts = {
            number
            for node in ast.walk(self.tree)
            if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
            for number in range(node.lineno, (node.end_lineno or node.lineno) + 1)
        }
        kept = []
        for number, line in enumerate(self.text.splitlines(), start=1):
            code = line.strip()
            plain = len(code) > 3 and not code.startswith(("#", "import ", "from ", "@"))
            if plain and number not in texts:
                kept.append((number, code))
        return kept


def _for_types(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"


def _is_number(node: ast.expr) -> bool:
    if isinstance(node, ast.Tuple):
        return bool(node.elts) and all(map(_is_number, node.elts))
    if isinstance(node, ast.UnaryOp):
        return _is_number(node.operand)
    if isinstance(node, ast.BinOp):
        return _is_number(node.left) and _is_number(node.right)
    if isinstance(node, ast.Call):
        return bool(node.args) and all(map(_is_number, node.args))
    return isinstance(node, ast.Constant) and isinstance(node.value, int | float) and not isinstance(node.value, bool)


def _bare(nodes: Iterable[ast.stmt]) -> Iterator[str]:
    """Public functions and classes among them without a docstring."""
    for node in nodes:
        public = isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_")
        if public and not ast.get_docstring(node):
            yield node.name


def _bases(owner: ast.ClassDef) -> set[str]:
    """Names of what a class extends, without the modules that they are from."""
    plain = (base.value if isinstance(base, ast.Subscript) else base for base in owner.bases)
    return {base.attr if isinstance(base, ast.Attribute) else getattr(base, "id", "") for base in plain}


def _said(owner: ast.ClassDef) -> set[str]:
    """Names that a class says something of: its methods with a docstring, and its attributes."""
    fields = {node.target.id for node in owner.body if isinstance(node, ast.AnnAssign)}
    return fields | {node.name for node in owner.body if isinstance(node, ast.FunctionDef) and ast.get_docstring(node)}


@dataclass(frozen=True)
class House:
    """All modules of the package by name."""

    modules: dict[str, Module]

    @classmethod
    def at(cls, folder: Path) -> House:
        """The package below src/ of a checkout."""
        root = folder / "src"
        found = {}
        for path in sorted(root.glob(f"{PACKAGE}/**/*.py")):
            parts = path.relative_to(root).with_suffix("").parts
            name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
            found[name] = Module(name, path.read_text(encoding="utf-8"))
        return cls(found)

    @classmethod
    def of(cls, revision: str) -> House:
        """The package as it was at a commit."""
        archive = subprocess.run(["git", "archive", revision, "src"], check=True, capture_output=True).stdout
        with tempfile.TemporaryDirectory() as folder:
            with tarfile.open(fileobj=io.BytesIO(archive)) as files:
                files.extractall(folder, filter="data")
            return cls.at(Path(folder))

    def arrows(self) -> Iterator[tuple[str, str]]:
        """Pairs of modules of which the first imports the second."""
        for module in self.modules.values():
            for full in module.imports():
                target = full if full in self.modules else full.rpartition(".")[0]
                if target in self.modules and target != module.name:
                    yield module.name, target

    def upward(self) -> list[str]:
        """Imports from a floor of one above it."""
        floors = {room: floor for floor, rooms in enumerate(FLOORS, start=1) for room in rooms}
        found = set()
        for source, target in self.arrows():
            # The package's face leans on everything.
            rooms = [self.modules[name].room for name in (source, target)]
            if source != PACKAGE and target != PACKAGE and floors.get(rooms[0], 0) < floors.get(rooms[1], 0):
                found.add(f"{source} → {target}")
        return sorted(found)

    def circles(self) -> list[str]:
        """Groups of modules that import each other, packages' faces aside."""
        after = defaultdict(set)
        for source, target in self.arrows():
            if not any(other.startswith(f"{name}.") for name in (source, target) for other in self.modules):
                after[source].add(target)
        reach = {name: _reached(after, name) for name in after}
        loops = {
            frozenset({name, *(x for x in seen if name in reach.get(x, ()))})
            for name, seen in reach.items()
            if name in seen
        }
        return sorted(", ".join(sorted(loop)) for loop in loops)

    def bare(self) -> list[str]:
        """Public functions, classes and methods without a docstring; what overrides an interface has that one's.

        An interface is a class that is extended, or any protocol, as those are met without being named.
        """
        owners = defaultdict(list)
        for module in self.modules.values():
            for owner in module.classes():
                owners[owner.name].append(owner)
        extends = {name: set().union(*map(_bases, same)) for name, same in owners.items()}
        protocols = {name for name, bases in extends.items() if "Protocol" in bases}
        found = []
        for module in self.modules.values():
            found += [f"{module.name}.{name}" for name in _bare(module.tree.body)]
            for owner in module.classes():
                above = (protocols | _reached(extends, owner.name)) - {owner.name}
                said = set().union(*(_said(one) for name in above for one in owners[name]))
                if not owner.name.startswith("_"):
                    found += [f"{module.name}.{owner.name}.{name}" for name in _bare(owner.body) if name not in said]
        return found

    def twins(self) -> list[str]:
        """Names of public classes that stand for several."""
        homes = defaultdict(list)
        for module in self.modules.values():
            for owner in module.classes():
                homes[owner.name].append(module.name)
        return [
            f"{name}: {', '.join(where)}"
            for name, where in sorted(homes.items())
            if len(where) > 1 and not name.startswith("_")
        ]

    def blocks(self) -> list[str]:
        """Places where BLOCK or more lines of code stand that stand elsewhere, too."""
        places = defaultdict(list)
        for module in self.modules.values():
            lines = module.significant()
            for first in range(len(lines) - BLOCK + 1):
                places[tuple(code for _, code in lines[first : first + BLOCK])].append((module.name, lines[first][0]))
        pairs, told = [], set()
        for where in places.values():
            names = tuple(sorted({name for name, _ in where}))
            if len(where) > 1 and names not in told:
                told.add(names)
                pairs.append(" ~ ".join(f"{name}:{line}" for name, line in where))
        return pairs


def _reached(after: dict[str, set[str]], start: str) -> set[str]:
    seen: set[str] = set()
    ends = list(after[start])
    while ends:
        name = ends.pop()
        if name not in seen:
            seen.add(name)
            ends += after.get(name, ())
    return seen


def measures(house: House) -> dict[str, object]:
    """What the house is like, by what is measured."""
    modules = house.modules.values()
    fits = [module for module in modules if module.room == "fitting"]
    lengths = sorted(
        (node.end_lineno - node.lineno + 1, f"{m.name}.{node.name}") for m in modules for node in m.functions()
    )
    counts = [length for length, _ in lengths]
    rooms = Counter(module.room for module in modules)
    return {
        "modules": len(house.modules),
        "lines": sum(module.lines for module in modules),
        "rooms": len(rooms),
        "most modules side by side": max(Counter(name.rpartition(".")[0] for name in house.modules).values()),
        "functions": len(counts),
        "function, median lines": statistics.median(counts),
        "function, 90 % lines": counts[int(0.9 * len(counts))],
        "function, largest": f"{lengths[-1][0]} ({lengths[-1][1]})",
        f"files over {LONG_FILE} lines": sum(module.lines > LONG_FILE for module in modules),
        "constants in fitting/": sum(len(list(m.constants())) for m in fits),
        "numbers among the options of fits": sum(len(list(m.settings())) for m in fits if m.name.endswith("options")),
        "constants in all": sum(len(list(m.constants())) for m in modules),
        "public names without docstring": len(house.bare()),
        "names of several classes": len(house.twins()),
        "circles of imports": len(house.circles()),
        "imports of what is above": len(house.upward()),
        f"blocks of {BLOCK} lines that stand twice": len(house.blocks()),
    }


def by_room(house: House) -> dict[str, str]:
    """Modules and lines of each room."""
    groups = defaultdict(list)
    for module in house.modules.values():
        groups[module.room].append(module.lines)
    return {room: f"{len(lines)} / {sum(lines)}" for room, lines in sorted(groups.items()) if len(lines) > 1}


def main() -> None:
    """Print the measures, beside those of a commit if one is named."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--since", metavar="REV", help="a commit to compare with")
    parser.add_argument(
        "--list", action="store_true", help="name the circles, upward imports, blocks, bare names and twins"
    )
    wanted = parser.parse_args()
    now = House.at(Path(__file__).parents[1])
    houses = [House.of(wanted.since), now] if wanted.since else [now]
    for measure in (measures, by_room):
        tables = [measure(house) for house in houses]
        names = list(dict.fromkeys(name for table in tables for name in table))
        for name in names:
            print(f"{name:40}" + "".join(f"  {table.get(name, '')!s:32}" for table in tables).rstrip())
        print()
    if wanted.list:
        titles = ("circle", now.circles()), ("up", now.upward()), ("twice", now.blocks())
        for title, found in (*titles, ("bare", now.bare()), ("twin", now.twins())):
            print(*(f"{title}: {item}" for item in found), sep="\n")


if __name__ == "__main__":
    main()
