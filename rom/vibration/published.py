"""Published figures of the modal study, where the repository's data folder stands beside the package."""

from __future__ import annotations

import re
import tomllib
from functools import cache
from typing import Any

from rom.provenance import PACKAGE

_MODE = re.compile(r"mode_(\d+)(_about)?")


@cache
def published() -> dict[str, Any]:
    """The tables of ``data/published.toml``; empty where the file does not exist, as in an installed wheel."""
    path = PACKAGE.parent / "data" / "published.toml"
    return tomllib.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}


def published_frequencies() -> dict[int, float]:
    """Natural frequencies [Hz] with the rear free by mode number, as far as they are printed in the text."""
    values = published().get("digitip", {}).get("natural_frequency_hz", {})
    found = {name: _MODE.fullmatch(name) for name in values}
    return {int(match[1]): float(values[name]) for name, match in found.items() if match}
