"""The house: imports go downwards only, there is no circle, and nothing is too long to be one idea."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest
import rom

PACKAGE = Path(rom.__file__).parent
FILES = sorted(PACKAGE.rglob("*.py"))
LONGEST = 350


def test_imports_go_downwards_only_and_never_in_circles():
    # a process of its own: the linter sets up logging for its own purposes
    lint = "import sys; from importlinter.cli import lint_imports; sys.exit(lint_imports(no_cache=True))"
    done = subprocess.run([sys.executable, "-c", lint], cwd=PACKAGE.parent, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.relative_to(PACKAGE).as_posix())
def test_a_file_holds_one_idea(path):
    assert len(path.read_text(encoding="utf-8").splitlines()) <= LONGEST


def test_private_members_stay_private():
    """An attribute with a leading underscore is read on ``self``, ``cls``, a class of its file or its own module."""
    found = []
    for path in FILES:
        tree = ast.parse(path.read_text(encoding="utf-8"))
        own = {target for node in ast.walk(tree) for target in _defined(node)}
        for node in ast.walk(tree):
            if not isinstance(node, ast.Attribute) or not node.attr.startswith("_") or node.attr.startswith("__"):
                continue
            if node.attr not in own and not _is_self(node.value) and node.attr not in NAMED_TUPLES:
                found.append(f"{path.relative_to(PACKAGE)}:{node.lineno} {ast.unparse(node)}")
    assert not found, found


NAMED_TUPLES = {"_replace", "_asdict", "_fields"}
"""What namedtuples call public."""


def _is_self(value: ast.expr) -> bool:
    return (isinstance(value, ast.Name) and value.id in ("self", "cls")) or (
        isinstance(value, ast.Call) and ast.unparse(value.func) in ("super", "type"))


def _defined(node: ast.AST) -> set[str]:
    """Private names that a file gives to attributes, functions or fields of its own."""
    if isinstance(node, ast.FunctionDef | ast.ClassDef):
        return {node.name}
    if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
        return {node.attr}
    if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
        return {node.target.id}
    return set()
