"""Where a result came from: software versions, source digest, commit, machine, threads."""

from __future__ import annotations

import hashlib
import os
import platform
import subprocess
from collections.abc import Iterable
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
def source_digest(*parts: str) -> str:
    """sha256 over the package's source files below ``parts`` (folders or files relative to the package; absolute
    paths of files beside it)."""
    digest = hashlib.sha256()
    for path in _sources(parts):
        digest.update(os.path.relpath(path, PACKAGE).encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()


def _sources(parts: Iterable[str]) -> list[Path]:
    files: set[Path] = set()
    for part in parts:
        path = PACKAGE / part
        files.update(path.rglob("*.py") if path.is_dir() else [path])
    return sorted(files)


def stamp(**extra: str) -> dict[str, str]:
    """Global attributes that every written file carries."""
    return {"software": "fingertip-rom", "software_versions": versions(), "commit": commit(), **extra}
