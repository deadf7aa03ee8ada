"""The option ``--seed``."""

from __future__ import annotations

import argparse

LARGEST_SEED = 2**63 - 1
"""What fits into the attribute of a file."""


def seed(text: str) -> int:
    """A word of the command line as a seed; argparse's own error for another."""
    if not text.isdecimal() or len(text) > 19 or int(text) > LARGEST_SEED:
        shown = repr(text if len(text) <= 40 else f"{text[:40]}...")
        raise argparse.ArgumentTypeError(f"{shown} is no seed, give a whole number from zero up to {LARGEST_SEED}")
    return int(text)
