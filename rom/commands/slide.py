"""`rom slide`: one finger pressed on glass and slid along it, as a table, and as files on demand."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rom.commands.files import check_files
from rom.commands.progress import bar

if TYPE_CHECKING:
    from collections.abc import Callable

    import xarray as xr

    from rom.finger_on_glass.finger import Finger
    from rom.finger_on_glass.observation import Observation
    from rom.finger_on_glass.path import LoadPath

PRESSING_POSITIONS, TRAVEL_POSITION = 5, 0.5
"""Positions while the plate is pressed on; distance of those along its travel [mm]."""
MOST_POSITIONS = 2000
SECTION = ("width", "height", "bone_width", "bone_height", "bone_offset")
VARIANTS = "radial, circumferential, random"


def add(commands: Any) -> None:
    """Add the sub-command."""
    parser = commands.add_parser("slide", help="press a section of the finger on glass and slide it")
    parser.add_argument("--variant", default="radial", help=f"arrangement of the fibres: {VARIANTS} (default radial)")
    parser.add_argument("--c", type=float, default=3.0, metavar="KPA", help="stiffness of the matrix (default 3)")
    parser.add_argument("--k1", type=float, metavar="KPA",
                        help="stiffness of the fibres (default: the published one of the variant, 150 or 3)")
    parser.add_argument("--friction", type=float, default=1.0, help="Coulomb coefficient (default 1)")
    parser.add_argument("--force", type=float, default=0.5, metavar="N", help="that presses (default 0.5)")
    parser.add_argument("--travel", type=float, default=8.0, metavar="MM",
                        help="of the plate under that force (default 8; 0 only presses)")
    parser.add_argument("--section", action="append", default=[], metavar="NAME=VALUE",
                        help=f"change the section [mm]: {', '.join(SECTION)}; repeatable")
    parser.add_argument("--axial-stiffness", type=float, default=100.0, metavar="N",
                        help="against out-of-plane strain (default 100; inf is plane strain)")
    parser.add_argument("--effective-length", type=float, default=10.0, metavar="MM",
                        help="by which the section's forces are multiplied (default 10)")
    parser.add_argument("--rays", type=int, default=100, help="elements around the bone (default 100)")
    parser.add_argument("--layers", type=int, default=12, help="elements from bone to skin (default 12)")
    parser.add_argument("--seed", type=int, default=0, help="of the random variant's fibres (default 0)")
    parser.add_argument("--output", type=Path, metavar="FILE.nc", help="write the path, as far as it went")
    parser.add_argument("--figure", type=Path, metavar="FILE.png", help="draw it")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Follow, print, write."""
    from rom.errors import SolverError
    from rom.finger_on_glass.path import follow
    from rom.finger_on_glass.record import recorded

    check_files(arguments, {"output": ".nc", "figure": ".png"})
    finger, path = _finger(arguments), _path(arguments)
    answer = follow(finger, path, on_step=_ticker(path))
    found = recorded(finger, answer)
    print(_table(found))
    if arguments.output is not None:
        from rom.datasets.storage import write_netcdf

        write_netcdf(found, arguments.output)
        print(arguments.output)
    if arguments.figure is not None:
        from rom.reporting.figure import Figure
        from rom.reporting.slide import draw_path

        Figure(arguments.figure.name, draw_path(found), "", "").write(arguments.figure.parent)
        print(arguments.figure)
    if not answer.complete:
        raise SolverError(answer.reason)


def _finger(arguments: argparse.Namespace) -> Finger:
    from rom.finger_on_glass.contact import Glass
    from rom.finger_on_glass.finger import Finger, OutOfPlane
    from rom.finger_on_glass.section import Section
    from rom.finger_on_glass.tissue import Tissue

    k1 = None if arguments.k1 is None else 1e-3 * arguments.k1
    for name in ("c", "k1"):
        value = getattr(arguments, name)
        if value is not None and not 0 < value < math.inf:
            raise ValueError(f"--{name} is {value:g} kPa, but it must be finite and above zero: give a stiffness")
    finger = Finger(Section(**_changes(arguments.section)), Tissue(arguments.variant, 1e-3 * arguments.c, k1,
                                                                   seed=arguments.seed),
                    Glass(arguments.friction), OutOfPlane(arguments.axial_stiffness, arguments.effective_length),
                    arguments.rays, arguments.layers)
    finger.mesh  # noqa: B018  # a mesh that cannot be is refused before any work
    return finger


def _changes(given: list[str]) -> dict[str, float]:
    """Lengths of the section from ``NAME=VALUE``."""
    found: dict[str, float] = {}
    for change in given:
        name, equals, text = (part.strip() for part in change.partition("="))
        if not (name and equals and text):
            raise ValueError(f"--section got {change!r}, but it needs NAME=VALUE: write for example bone_offset=0.5")
        if name not in SECTION:
            raise ValueError(f"--section does not know {name!r}: choose among {', '.join(SECTION)}")
        if name in found:
            raise ValueError(f"--section names {name} twice: give each value once")
        try:
            found[name] = float(text)
        except ValueError:
            raise ValueError(f"--section {name} got {text!r}, but it needs a length: write for example "
                             f"{name}=1.2") from None
    return found


def _path(arguments: argparse.Namespace) -> LoadPath:
    import numpy as np

    from rom.finger_on_glass.path import LoadPath

    for name, value, unit in (("force", arguments.force, "N"), ("travel", arguments.travel, "mm")):
        if not 0 <= value < 1e3 or (name == "force" and value == 0):
            raise ValueError(f"--{name} is {value:g} {unit}, but it must be "
                             f"{'above zero' if name == 'force' else 'zero or more'} and below 1000: change it")
    count = math.ceil(arguments.travel / TRAVEL_POSITION - 1e-9)
    if count > MOST_POSITIONS:
        raise ValueError(f"--travel {arguments.travel:g} mm goes round the finger many times: give "
                         f"{MOST_POSITIONS * TRAVEL_POSITION:g} mm at most")
    return LoadPath(tuple(np.linspace(0, arguments.force, PRESSING_POSITIONS + 1)[1:]),
                    tuple(np.linspace(0, arguments.travel, count + 1)[1:]))


def _ticker(path: LoadPath) -> Callable[[Observation], None]:
    """Moves a bar on by the positions that were passed."""
    pressing, travel = path.normal_force, path.travel
    ticks = iter(bar(range(len(pressing) + len(travel)), "positions"))
    next(ticks)
    passed = 0

    def tick(seen: Observation) -> None:
        nonlocal passed
        reached = sum(seen.normal_force > f - 1e-6 * f for f in pressing) + sum(
            seen.tangential_displacement > x - 1e-9 for x in travel)
        while passed < reached:
            passed += 1
            next(ticks, None)

    return tick


def _table(found: xr.Dataset) -> str:
    """A line for each position."""
    lines = [f"{'u_N [mm]':>9} {'u_T [mm]':>9} {'F_N [N]':>9} {'F_T [N]':>9} {'width [mm]':>11} {'area [mm2]':>11} "
             f"{'peak [kPa]':>11} {'slipping':>10}"]
    for k in range(found.sizes["position"]):
        one = {name: round(float(found[name][k]), 9) + 0.0 for name in (  # no negative zeros
            "normal_displacement", "tangential_displacement", "normal_force", "tangential_force", "width", "area",
            "peak_pressure", "slipping", "touching")}
        share = f"{one['slipping']:.0f} of {one['touching']:.0f}"
        lines.append(f"{1e3 * one['normal_displacement']:>9.4f} {1e3 * one['tangential_displacement']:>9.3f} "
                     f"{one['normal_force']:>9.4f} {round(one['tangential_force'], 4) + 0.0:>9.4f} "
                     f"{1e3 * one['width']:>11.3f} {1e6 * one['area']:>11.2f} "
                     f"{1e-3 * one['peak_pressure']:>11.2f} {share:>10}")
    attrs, last = found.attrs, found.isel(position=-1)
    rest = abs(float(last["work"] - last["energy"] - last["dissipated"]))
    share = f"{100 * rest / float(last['work']):.2f} %" if float(last["work"]) > 0 else "none"
    lines.append(f"{attrs['tissue.variant']} fibres, {attrs['rays']} x {attrs['layers']} elements; "
                 f"{int(last['steps'])} steps, {int(last['iterations'])} iterations; energy balance "
                 f"open by {share} of the work; viscous resistance {float(found['viscosity'].max()):g} Pa at most")
    return "\n".join(lines)
