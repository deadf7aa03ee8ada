"""A content-addressed store: what was computed once under the same inputs and the same code is found again.

The key is a digest of a JSON recipe, which names everything that the content depends on (anatomy, mesh, settings, data,
source files). A changed tissue modulus changes the key, so nothing stale can be found.
"""

from __future__ import annotations

import hashlib
import json
import os
from pathlib import Path
from typing import Any


def cache_folder() -> Path:
    """``$ROM_CACHE``, or ``fingertip-rom`` in the user's cache folder."""
    if "ROM_CACHE" in os.environ:
        return Path(os.environ["ROM_CACHE"])
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "fingertip-rom"


def cached_path(kind: str, recipe: dict[str, Any], suffix: str = ".nc") -> Path:
    """Where the content of ``recipe`` lies, or would lie.

    Parameters
    ----------
    kind : str
        Folder: "datasets", "models", ...
    recipe : dict
        JSON-able; everything that the content depends on.
    """
    digest = hashlib.sha256(json.dumps([kind, recipe], sort_keys=True).encode()).hexdigest()
    return cache_folder() / kind / f"{digest[:24]}{suffix}"
