"""Comparison: every metamodel on the same held-out cases."""

from rom.comparison.entries import chosen_curves
from rom.comparison.side_by_side import COMPARED, compare, compared, scene_of, write_results

__all__ = ["COMPARED", "chosen_curves", "compare", "compared", "scene_of", "write_results"]
