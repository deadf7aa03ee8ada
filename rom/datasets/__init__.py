"""Datasets: cases with their answers, one schema for every method, stored as netCDF."""

from rom.datasets.schema import SCHEMA_VERSION, check_scene, check_schema
from rom.datasets.snapshots import draw_cases, make_dataset, solve_cases, solve_dataset
from rom.datasets.splits import SPLITS, carve_validation, select
from rom.datasets.storage import read_dataset, write_dataset

__all__ = ["SCHEMA_VERSION", "SPLITS", "carve_validation", "check_scene", "check_schema", "draw_cases",
           "make_dataset", "read_dataset", "select", "solve_cases", "solve_dataset", "write_dataset"]
