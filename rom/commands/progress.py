"""Progress at the surface: a bar on standard error where a person watches."""

from __future__ import annotations

import sys
from collections.abc import Iterable


def bar(items: Iterable, title: str) -> Iterable:
    """Wrap an iteration in a progress bar."""
    from tqdm import tqdm

    return tqdm(items, desc=title, file=sys.stderr, leave=False, disable=None)
