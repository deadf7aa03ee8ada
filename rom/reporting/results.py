"""A results file, asked the questions that figures, tables and sentences share.

What a page says of a scene and of its methods stands in the results: ``title``, ``question``, ``gate``, ``case_noun``,
``partial_output``, ``full_order`` (names of the methods that solve the full model itself, the truth first),
``learners``, ``method_colours`` (all methods, in one order), ``method_summaries``, ``not_applicable``,
``quantity_definitions``. Older files lack some; the words of this module stand in for them.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr

from rom.reporting import palette

REQUIRED = ("method", "setting", "headline", "split", "error_max", "online_seconds")
FULL_ORDER = ("direct", "direct-reused")
WORKLOADS = {"one": "online_seconds", "batch": "batch_seconds", "part": "output_seconds", "call": "predict_seconds"}
"""What one may want a method to do, by the variable that holds its time: one answer as an array, an answer in a large
batch, only the part of it that the scene wants, one labelled answer with all that `predict` says of it."""


class Results:
    """Read-only view of the `xarray.Dataset` that a comparison wrote.

    Parameters
    ----------
    data : xr.Dataset
        Dimensions ``entry`` (a method at a setting), ``split``, ``repeat``, ``case``, ``region`` and more; variables
        that are absent count as not measured.

    Raises
    ------
    ValueError
        Where a variable is missing without which nothing can be said, or the full-order method.
    """

    def __init__(self, data: xr.Dataset) -> None:
        missing = [name for name in REQUIRED if name not in data.variables]
        if missing:
            raise ValueError(f"the results lack {', '.join(missing)}: make them again with `rom compare`")
        self.data = data
        if self.truth not in self.methods:
            raise ValueError(f"the results lack the method {self.truth!r}, against which all others are judged: "
                             "make them again with `rom compare`")

    # ---- entries --------------------------------------------------------------------------------------------

    @cached_property
    def method(self) -> list[str]:
        """Method of each entry."""
        return [str(name) for name in self.data["method"].values]

    @cached_property
    def methods(self) -> list[str]:
        """Methods in the order of the file."""
        return list(dict.fromkeys(self.method))

    @cached_property
    def solvers(self) -> list[str]:
        """Methods that solve the full-order model itself."""
        return list(self.record("full_order") or FULL_ORDER)

    @property
    def truth(self) -> str:
        """The method whose answers are the truth."""
        return self.solvers[0]

    @cached_property
    def reduced(self) -> list[str]:
        """Every method that does not solve the full-order model."""
        return [name for name in self.methods if name not in self.solvers]

    @cached_property
    def learners(self) -> list[str]:
        """Methods that learn from solved cases: by default those whose preparation holds snapshots."""
        named, snapshots = self.record("learners"), self.per_entry("snapshot_seconds")
        if named is not None:
            return [name for name in self.methods if name in named]
        return [name for name in self.reduced if any(snapshots[i] > 0 for i in self.entries(name))]

    def entries(self, method: str) -> list[int]:
        """Positions of a method's entries."""
        return [i for i, name in enumerate(self.method) if name == method]

    def headline(self, method: str) -> int:
        """Position of the entry that stands for a method."""
        marked = self.data["headline"].values.astype(bool)
        return next((i for i in self.entries(method) if marked[i]), self.entries(method)[0])

    def setting(self, entry: int) -> str:
        """``modes=40 vectors=8``, or an empty string."""
        return str(self.data["setting"].values[entry])

    def name(self, entry: int) -> str:
        """Method with its setting in brackets."""
        setting = self.setting(entry)
        return f"{self.method[entry]} ({setting})" if setting else self.method[entry]

    def label(self, entry: int) -> str:
        """The entry's own label in the file."""
        return str(self.data["entry"].values[entry]) if "entry" in self.data.coords else self.name(entry)

    @cached_property
    def worst(self) -> list[tuple[int, int]]:
        """(row along ``worst``, entry) of the reduced methods whose worst case is stored, the most accurate first."""
        position = {self.label(i): i for i in range(len(self.method))}
        errors = self.errors(self.splits[0])
        rows = [(k, position[str(label)]) for k, label in enumerate(self.data["worst"].values)
                if str(label) in position] if "worst" in self.data.variables else []
        return sorted((pair for pair in rows if self.method[pair[1]] in self.reduced and np.isfinite(errors[pair[1]])),
                      key=lambda pair: errors[pair[1]])

    def style(self, method: str) -> palette.Style:
        """Colour and marker of a method."""
        return palette.style(method, self.record("method_colours") or palette.COLOURS)

    # ---- times ----------------------------------------------------------------------------------------------

    def per_entry(self, name: str) -> np.ndarray:
        """(entry,) ndarray of float, medians of repeats; NaN where not measured."""
        if name not in self.data:
            return np.full(len(self.method), np.nan)
        values = np.asarray(self.data[name].transpose("entry", ...).values, dtype=float)
        return medians(values) if values.ndim == 2 else values

    @cached_property
    def online(self) -> np.ndarray:
        """(entry,) ndarray [s]: median time of one case, whole answer."""
        return self.seconds("one")

    def seconds(self, workload: str) -> np.ndarray:
        """(entry,) ndarray [s]: time of a workload (`WORKLOADS`); NaN where not measured."""
        times = self.per_entry(WORKLOADS[workload])
        if workload == "call" and not np.isfinite(times).any():  # older results hold what the call adds
            return self.online + self.per_entry("call_seconds")
        return times

    def baseline(self, workload: str = "one") -> int:
        """Entry of the fastest full-order method for a workload."""
        times = self.seconds(workload)
        return min((self.headline(name) for name in self.solvers if name in self.methods),
                   key=lambda i: times[i] if np.isfinite(times[i]) else np.inf)

    def speedup(self, workload: str = "one") -> np.ndarray:
        """(entry,) ndarray: time of the fastest full-order method for the same workload over the entry's time."""
        times = self.seconds(workload)
        with np.errstate(divide="ignore", invalid="ignore"):
            return times[self.baseline(workload)] / times

    @cached_property
    def break_even(self) -> np.ndarray:
        """(entry,) ndarray: single answers after which preparation is repaid; infinite where it never is."""
        offline, saved = self.per_entry("offline_seconds"), self.online[self.baseline()] - self.online
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(np.isnan(offline + saved), np.nan, np.where(saved > 0, offline / saved, np.inf))

    # ---- errors ---------------------------------------------------------------------------------------------

    @cached_property
    def splits(self) -> list[str]:
        return [str(name) for name in self.data["split"].values]

    def errors(self, split: str, statistic: str = "max") -> np.ndarray:
        """(entry,) ndarray: relative error over the held-out cases; statistic max, p95 or median."""
        return self.by_split(f"error_{statistic}", split)

    def projection_errors(self, split: str) -> np.ndarray:
        """(entry,) ndarray: best error that a method's own basis allows."""
        return self.by_split("projection_error_max", split)

    def by_split(self, name: str, split: str) -> np.ndarray:
        """(entry,) ndarray: a variable along (entry, split) at one split; NaN where absent."""
        if name not in self.data or split not in self.splits:
            return np.full(len(self.method), np.nan)
        return np.asarray(self.data[name].transpose("entry", "split").values[:, self.splits.index(split)], dtype=float)

    def case_errors(self, entry: int, split: str) -> np.ndarray:
        """(case,) ndarray: relative error of each case, NaN where it is not held out."""
        array = self.data["case_error"].transpose("entry", "split", "case").values
        return np.asarray(array[entry, self.splits.index(split)], dtype=float)

    def judged(self, entry: int, split: str) -> tuple[int, int]:
        """Held-out cases on which an entry was judged, and the largest such number of any entry."""
        if "case_error" not in self.data or split not in self.splits:
            return 0, 0
        known = np.isfinite(self.data["case_error"].sel(split=split).transpose("entry", "case").values).sum(axis=1)
        return int(known[entry]), int(known.max())

    @cached_property
    def regions(self) -> list[str]:
        """Parts that the last split keeps from training."""
        known = "region" in self.data.variables and "error_by_region" in self.data
        return [str(name) for name in self.data["region"].values] if known else []

    @cached_property
    def region_errors(self) -> np.ndarray:
        """(entry, region) ndarray: largest error in each part; NaN where it has no case."""
        if not self.regions:
            return np.zeros((len(self.method), 0))
        return np.asarray(self.data["error_by_region"].transpose("entry", "region").values, dtype=float)

    @cached_property
    def quantities(self) -> list[str]:
        """Quantities that are judged beside the main one."""
        known = "quantity" in self.data.variables and self._of_quantities
        return [str(name) for name in self.data["quantity"].values] if known else []

    def quantity_errors(self, statistic: str = "max") -> np.ndarray:
        """(entry, split, quantity) ndarray: error of each of `quantities` over the held-out cases."""
        name = next(name for name in self._of_quantities if name.endswith(f"_{statistic}"))
        return np.asarray(self.data[name].transpose("entry", "split", "quantity").values, dtype=float)

    @cached_property
    def _of_quantities(self) -> list[str]:
        return [str(name) for name in self.data if set(self.data[name].dims) == {"entry", "split", "quantity"}]

    def scalar(self, name: str) -> float:
        """A scalar variable; NaN where absent."""
        return float(self.data[name].values) if name in self.data and self.data[name].ndim == 0 else float("nan")

    # ---- choices --------------------------------------------------------------------------------------------

    @cached_property
    def gate(self) -> float:
        """Largest maximum error that may be called trustworthy."""
        return float(self.data.attrs.get("gate", 0.05))

    @property
    def validated(self) -> bool:
        """Whether settings can be chosen by the errors of cases that are neither learned from nor judged."""
        return "validation_error_max" in self.data

    def within(self, level: float, splits: Sequence[str]) -> np.ndarray:
        """(entry,) ndarray of bool: entries that may be chosen for a level of error on all of some splits."""
        name = "validation_error_max" if self.validated else "error_max"
        return np.all([self.by_split(name, split) <= level for split in splits], axis=0)

    def fastest(self, allowed: np.ndarray, cost: np.ndarray) -> int | None:
        """The entry of least cost among those allowed, full-order methods aside; None where there is none."""
        found = [int(i) for i in np.flatnonzero(allowed) if np.isfinite(cost[i]) and self.method[i] in self.reduced]
        return min(found, key=lambda i: cost[i], default=None)

    def best(self, method: str, split: str) -> int | None:
        """The method's most accurate entry on a split; None where it has no finite error."""
        errors = self.errors(split)
        found = [i for i in self.entries(method) if np.isfinite(errors[i])]
        return min(found, key=lambda i: errors[i]) if found else None

    # ---- the scene ------------------------------------------------------------------------------------------

    @property
    def noun(self) -> str:
        """What one case is called."""
        return self.text("case_noun", "case")

    @property
    def partial(self) -> str:
        """What an answer consists of where the whole is not wanted."""
        return self.text("partial_output") or "part that is wanted"

    def text(self, name: str, default: str = "") -> str:
        """A global attribute as text."""
        return str(self.data.attrs.get(name, default))

    def number(self, name: str) -> float:
        """A global attribute as a number; NaN where absent."""
        return float(self.data.attrs.get(name, np.nan))

    def record(self, name: str) -> Any:
        """A global attribute that holds JSON; None where absent."""
        value = self.data.attrs.get(name)
        return json.loads(value) if isinstance(value, str) and value else None


def medians(values: np.ndarray) -> np.ndarray:
    """(n,) ndarray: median of each row over its finite values; NaN where it has none."""
    values = np.where(np.isfinite(values), values, np.nan)
    result = np.full(len(values), np.nan)
    some = np.isfinite(values).any(axis=1)
    result[some] = np.nanmedian(values[some], axis=1)
    return result
