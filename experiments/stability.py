"""Every method at stiff and extreme cases, pushed until something breaks: who is right, who warns, who lies?"""

from __future__ import annotations

import argparse
import math

import script
import xarray as xr
from atlas import atlas
from presentation.stability import OUTCOMES, counts, draw, findings, tables, worst_first


def options(parser: argparse.ArgumentParser) -> None:
    """Which extremes, and who is asked."""
    parser.add_argument("--axis", action="append", dest="axes", metavar="NAME",
                        help="one axis of extremes; repeatable (default: all)")
    parser.add_argument("--methods", type=lambda text: [name.strip() for name in text.split(",")], metavar="NAMES",
                        help="comma-separated (default: all)")


def main(quick: bool = False, progress: script.Progress = script.silent, axes: list[str] | None = None,
         methods: list[str] | None = None) -> xr.Dataset:
    """Where does each method break, and does it say so?"""
    results = atlas(quick=quick, axes=axes, methods=methods, progress=progress)
    print(table(results))
    return results


def table(results: xr.Dataset) -> str:
    """Defects one by one, then counts by axis and by method."""
    lines = []
    for i, j in worst_first(results, "silent", "crashed"):
        one = results.isel(case=i, method=j)
        error = float(one["error"])
        size = f"{error:8.1e}" if math.isfinite(error) else " unknown"
        lines.append(f"{one['outcome'].item():<8} {size}  {one['method'].item():<15} {one['axis'].item()}: "
                     f"{one['level'].item()}" + (f"  ({one['message'].item()[:80]})" if one["message"].item() else ""))
    lines = lines or ["no answer was silently wrong, nothing crashed"]
    axes = results["axis"].values
    groups = [(str(name), results.isel(case=axes == name)) for name in dict.fromkeys(axes)]
    groups += [(str(name), results.sel({"method": [name]})) for name in results["method"].values]
    lines += ["", f"{'':<30}" + "".join(f"{name:>9}" for name in OUTCOMES)]
    for name, part in [*groups, ("all", results)]:
        number = counts(part)
        if sum(number.values()):
            lines.append(f"{name:<30}" + "".join(f"{number[outcome]:>9}" for outcome in OUTCOMES))
    return "\n".join(lines)


if __name__ == "__main__":
    script.run(main, draw, findings, "stability", tables=tables, options=options)
