"""Figures, sentences and pages from a results file alone; matplotlib is imported when a figure is drawn."""

from rom.reporting.conclusions import conclusions, verdict
from rom.reporting.index import write_index
from rom.reporting.report import write_report

__all__ = ["conclusions", "verdict", "write_index", "write_report"]
