"""Datasets: cases with their answers, one schema for every method, stored as netCDF."""

from rom.datasets.combinations import draw_combinations, superposed, unit_responses
from rom.datasets.reduced import ReducedField, open_dataset, read_dataset
from rom.datasets.schema import SCHEMA_VERSION, check_schema
from rom.datasets.snapshots import draw_cases, make_dataset, solve_dataset
from rom.datasets.splits import SPLITS, carve_validation, select
from rom.datasets.storage import write_dataset
from rom.datasets.whole import make_whole_dataset

__all__ = ["SCHEMA_VERSION", "SPLITS", "ReducedField", "carve_validation", "check_schema", "draw_cases",
           "draw_combinations", "make_dataset", "make_whole_dataset", "open_dataset", "read_dataset", "select",
           "solve_dataset", "superposed", "unit_responses", "write_dataset"]
