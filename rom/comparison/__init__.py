"""Comparison: every metamodel on the same held-out cases."""

from rom.comparison.side_by_side import compare, write_results

__all__ = ["compare", "write_results"]
