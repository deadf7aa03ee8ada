"""Where a result came from: software versions, source digest, commit, machine, threads."""

from __future__ import annotations

import ast
import hashlib
import os
import platform
import subprocess
import sys
from functools import cache
from importlib import metadata
from pathlib import Path

PACKAGE = Path(__file__).parent
LIBRARIES = ("numpy", "scipy", "scikit-fem", "scikit-learn", "xarray", "netCDF4", "mkl", "torch")


@cache
def commit() -> str:
    """The commit that the package runs from, with ``+changes`` where files differ, or ``unknown``."""
    def git(*words: str) -> str:
        return subprocess.run(["git", "-C", str(PACKAGE), *words], capture_output=True, text=True, check=True).stdout
    try:
        git("ls-files", "--error-unmatch", "provenance.py")  # an installed copy may lie inside another repository
        return git("rev-parse", "HEAD").strip() + ("+changes" if git("status", "--porcelain", "--", ".") else "")
    except (OSError, subprocess.CalledProcessError):
        return "unknown"


@cache
def versions() -> str:
    """``name version`` of the libraries that numbers depend on, comma-separated."""
    found = [f"python {platform.python_version()}"]
    for name in LIBRARIES:
        try:
            found.append(f"{name} {metadata.version(name)}")
        except metadata.PackageNotFoundError:
            found.append(f"{name} absent")
    return ", ".join(found)


def machine() -> str:
    """Processor and number of usable cores."""
    model = platform.processor() or platform.machine()
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as lines:
            model = next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), model)
    except OSError:
        pass
    return f"{model}, {usable_cores()} cores, {platform.system()}"


def usable_cores() -> int:
    """Cores that this process may run on."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@cache
def source_digest(*modules: str) -> str:
    """sha256 over the source of modules and of everything of this package that they import, lazily or not.

    Parameters
    ----------
    *modules : str
        Dotted names, such as ``"rom.metamodels.modal"``, or paths of files beside the package.
    """
    digest = hashlib.sha256()
    for name in import_closure(*modules):
        digest.update(os.path.basename(name).encode())
        digest.update(_source(name) or b"")
    return digest.hexdigest()


@cache
def import_closure(*modules: str) -> tuple[str, ...]:
    """Sorted names of modules and of all that they import of this package, found in their source."""
    found: set[str] = set()
    waiting = list(modules)
    while waiting:
        name = waiting.pop()
        if name not in found and _source(name) is not None:
            found.add(name)
            waiting += _imports(name)
    return tuple(sorted(found))


@cache
def _imports(module: str) -> list[str]:
    """Dotted names that a module imports; what only type checkers import is left out."""
    tree, names = ast.parse(_source(module) or b""), []
    typing = {id(node) for part in ast.walk(tree) if isinstance(part, ast.If) and "TYPE_CHECKING" in ast.dump(part.test)
              for node in ast.walk(part)}
    for node in ast.walk(tree):
        if id(node) in typing:
            continue
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names += [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
    return [name for name in names if name.partition(".")[0] == PACKAGE.name]


@cache
def _source(name: str) -> bytes | None:
    """The source of a module; None where there is no such file."""
    if name.endswith(".py"):
        return Path(name).read_bytes()
    if name.partition(".")[0] != PACKAGE.name:  # a third party's method or scene: that file alone
        path = Path(getattr(sys.modules.get(name), "__file__", None) or "")
        return path.read_bytes() if path.suffix == ".py" and path.is_file() else None
    path = PACKAGE.parent.joinpath(*name.split("."))
    for file in (path.with_suffix(".py"), path / "__init__.py"):
        if file.is_file():
            return file.read_bytes()
    return None


def stamp(**extra: str) -> dict[str, str]:
    """Global attributes that every written file carries."""
    return {"software": "fingertip-rom", "software_versions": versions(), "commit": commit(), **extra}
