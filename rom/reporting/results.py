"""A results file, asked the questions that figures, tables and sentences share."""

from __future__ import annotations

import json
import re
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr

from rom.scenes import SCENES

DIRECT = "direct"
LEARNED = ("pod-regression", "transformer", "mlp", "mlp-residual", "pole-network")
"""Methods whose answer is a regression on samples; the others project or solve."""
SOLVERS = (DIRECT, "direct-reused")
"""Methods that solve the full-order model itself."""
UNSEEN_NODE = "unseen node"


class Results:
    """Read-only view of the `xarray.Dataset` that a comparison wrote.

    Parameters
    ----------
    data : xr.Dataset
        Dimensions ``entry`` (a method at a setting), ``split``, ``repeat``, ``case``, ``region`` and more; variables
        that are absent count as not measured.
    """

    def __init__(self, data: xr.Dataset) -> None:
        missing = [name for name in ("method", "setting", "headline", "split", "error_max", "online_seconds")
                   if name not in data.variables]
        if missing:
            raise ValueError(f"the results lack {', '.join(missing)}: make them again with `rom compare`")
        if DIRECT not in data["method"].values.astype(str):
            raise ValueError(f"the results lack the method {DIRECT!r}, against which speed-ups are measured: "
                             "make them again with `rom compare`")
        self.data = data

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
    def reduced(self) -> list[str]:
        """Every method but `direct`."""
        return [name for name in self.methods if name != DIRECT]

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
    def direct(self) -> int:
        """Position of the baseline."""
        return self.headline(DIRECT)

    # ---- numbers --------------------------------------------------------------------------------------------

    def per_entry(self, name: str) -> np.ndarray:
        """(entry,) ndarray of float; NaN where not measured."""
        if name not in self.data:
            return np.full(len(self.method), np.nan)
        return np.asarray(self.data[name].values, dtype=float)

    @cached_property
    def online(self) -> np.ndarray:
        """(entry,) ndarray [s]: median time of one case, full field."""
        return medians(self.data["online_seconds"].transpose("entry", "repeat").values)

    @cached_property
    def speedup(self) -> np.ndarray:
        """(entry,) ndarray: direct over method, one case, full field."""
        return self._ratio("speedup", self.online)

    @cached_property
    def batch_speedup(self) -> np.ndarray:
        """(entry,) ndarray: direct over method, a case in a large batch."""
        return self._ratio("batch_speedup", self.per_entry("batch_seconds"))

    @cached_property
    def output_speedup(self) -> np.ndarray:
        """(entry,) ndarray: direct over method, one case, only the :attr:`partial` answer."""
        return self._ratio("output_speedup", self.per_entry("output_seconds"))

    def _ratio(self, name: str, times: np.ndarray) -> np.ndarray:
        if name in self.data:
            return self.per_entry(name)
        with np.errstate(divide="ignore", invalid="ignore"):
            return times[self.direct] / times

    @cached_property
    def splits(self) -> list[str]:
        return [str(name) for name in self.data["split"].values]

    def errors(self, split: str, statistic: str = "max") -> np.ndarray:
        """(entry,) ndarray: relative error over the held-out cases; statistic max, p95 or median."""
        name = f"error_{statistic}"
        if name not in self.data or split not in self.splits:
            return np.full(len(self.method), np.nan)
        return np.asarray(self.data[name].transpose("entry", "split").values[:, self.splits.index(split)], dtype=float)

    def projection_errors(self, split: str) -> np.ndarray:
        """(entry,) ndarray: best error that a method's own basis allows."""
        if "projection_error_max" not in self.data or split not in self.splits:
            return np.full(len(self.method), np.nan)
        array = self.data["projection_error_max"].transpose("entry", "split").values
        return np.asarray(array[:, self.splits.index(split)], dtype=float)

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
        """Parts of the hard split."""
        return [str(name) for name in self.data["region"].values] if "region" in self.data.variables else []

    def region_error(self, entry: int, region: str) -> float:
        """Largest error in a part of the hard split; NaN where it has no case."""
        if region not in self.regions or "error_by_region" not in self.data:
            return float("nan")
        array = self.data["error_by_region"].transpose("entry", "region").values
        return float(array[entry, self.regions.index(region)])

    def scalar(self, name: str) -> float:
        """A scalar variable; NaN where absent."""
        return float(self.data[name].values) if name in self.data and self.data[name].ndim == 0 else float("nan")

    # ---- choices --------------------------------------------------------------------------------------------

    @cached_property
    def gate(self) -> float:
        """Largest maximum error that may be called trustworthy."""
        return float(self.data.attrs.get("gate", 0.05))

    def passing(self, splits: list[str], level: float | None = None) -> list[int]:
        """Entries other than `direct` within ``level`` (default: the gate) on all ``splits``, fastest first."""
        level = self.gate if level is None else level
        found = [i for i, name in enumerate(self.method) if name != DIRECT and np.isfinite(self.online[i])
                 and all(self.errors(split)[i] <= level for split in splits)]
        return sorted(found, key=lambda i: self.online[i])

    def best(self, method: str, split: str) -> int | None:
        """The method's most accurate entry on a split; None where it has no finite error."""
        errors = self.errors(split)
        found = [i for i in self.entries(method) if np.isfinite(errors[i])]
        return min(found, key=lambda i: errors[i]) if found else None

    # ---- the scene ------------------------------------------------------------------------------------------

    @property
    def partial(self) -> str:
        """What an answer consists of where the full field is not wanted."""
        return self.text("partial_output", "pad surface")

    @property
    def contact(self) -> bool:
        """Whether cases are load paths of a contact scene."""
        return "contact_error_max" in self.data

    @property
    def harmonic(self) -> bool:
        """Whether cases have a frequency."""
        return "frequency" in self.data.variables

    @cached_property
    def band_hz(self) -> float:
        """Upper end of the published frequency range [Hz]."""
        scene = SCENES.get(self.text("scene"))
        if scene is not None and scene.harmonic:
            return scene.band_hz
        held_out = np.isfinite(self.case_errors(self.direct, self.splits[0]))
        return float(self.data["frequency"].values[held_out].max())

    @cached_property
    def natural_hz(self) -> np.ndarray:
        """(natural_mode,) ndarray [Hz]; empty where no modes were solved for."""
        if "natural_frequency" not in self.data:
            return np.zeros(0)
        return np.asarray(self.data["natural_frequency"].values, dtype=float)

    def modes_kept(self, entry: int) -> int | None:
        """Number of modes that a setting names."""
        found = re.search(r"\bmodes=(\d+)", self.setting(entry))
        return int(found[1]) if found else None

    def text(self, name: str, default: str = "") -> str:
        """A global attribute as text."""
        return str(self.data.attrs.get(name, default))

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
