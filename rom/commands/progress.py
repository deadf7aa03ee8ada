"""Progress at the surface: a bar on standard error where a person watches."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterable, Iterator


def bar(items: Iterable, title: str) -> Iterable:
    """Wrap an iteration in a progress bar."""
    from tqdm import tqdm

    return tqdm(items, desc=title, file=sys.stderr, leave=False, disable=None)


def patient_bar(items: Iterable, title: str) -> Iterator:
    """A progress bar of a few long steps, whose clock runs on between them."""
    from tqdm import tqdm

    ended = threading.Event()
    with tqdm(items, desc=title, file=sys.stderr, leave=False, disable=None,
              bar_format="{desc} {n_fmt}/{total_fmt} |{bar}| {elapsed}") as shown:
        def tick() -> None:
            while not ended.wait(TICK):
                shown.refresh()

        threading.Thread(target=tick, daemon=True).start()
        try:
            yield from shown
        finally:
            ended.set()


TICK = 0.5
"""Seconds between two looks at the clock."""
