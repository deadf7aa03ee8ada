"""`rom frf`: how the pad answers to a vibrating force, as a table, and as files on demand."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rom.commands.files import check_files
from rom.commands.fingertip_options import add_fingertip_options, fingertip_from

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr

    from rom.metamodels.metamodel import Metamodel
    from rom.scenes import LinearScene

MODES, VECTORS = 12, 10
BEYOND = 1.15
"""Modes are kept up to this multiple of the highest frequency, and `MODES` of them at least."""
MOST_LINES = 40
MOST_FREQUENCIES = 100_000


def add(commands: Any) -> None:
    """Add the sub-command."""
    parser = commands.add_parser("frf", help="frequency response of the pad: receptance, phase, peaks")
    add_fingertip_options(parser)
    parser.add_argument("--directions", default="normal,radial-ulnar,distal-proximal", metavar="NAMES",
                        help="comma-separated: normal, radial-ulnar, distal-proximal (default all)")
    parser.add_argument("--from", type=float, default=1.0, metavar="HZ", dest="first", help="default 1")
    parser.add_argument("--to", type=float, default=260.0, metavar="HZ", dest="last", help="default 260")
    parser.add_argument("--step", type=float, default=1.0, metavar="HZ", help="default 1")
    parser.add_argument("--loss-factor", type=float, default=0.1, help="default 0.1")
    parser.add_argument("--amplitude", type=float, default=0.1, metavar="N", help="of the force (default 0.1)")
    parser.add_argument("--node", type=int, help="pad node at the centre of the nine loaded ones (default: the "
                                                 "fingerprint centroid)")
    parser.add_argument("--method", default="modal-krylov", help="one that needs no snapshots (default modal-krylov)")
    for option, metavar, words in (("--output", "FILE.nc", "write the responses"),
                                   ("--figure", "FILE.png", "draw them"),
                                   ("--vtu", "FILE.vtu", "write the field at one frequency for ParaView")):
        parser.add_argument(option, type=Path, metavar=metavar, help=words)
    parser.add_argument("--at", type=float, metavar="HZ", help="frequency of the --vtu field")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Compute, print, write."""
    from rom.scenes import get_scene
    from rom.vibration.frequency_response import frequency_response, sweep_cases

    frequency = _check(arguments)
    directions = [name.strip() for name in arguments.directions.split(",")]
    options: dict[str, Any] = {"amplitude": arguments.amplitude, "loss_factor": arguments.loss_factor}
    scene = get_scene("harmonic-patch-forces", fingertip_from(arguments),
                      sites=() if arguments.node is None else (arguments.node,))
    _check_method(arguments.method, scene)
    cases = sweep_cases(scene, frequency, directions, **options)  # refuses what cannot be before any solve
    model = _model(arguments, scene, float(frequency[-1])).fit()
    found = frequency_response(model, frequency, directions, **options)
    static = frequency_response(model, [0.0], directions, **options)["receptance"].isel(frequency=0, drop=True)
    found["static_receptance"] = abs(static).assign_attrs(
        long_name="magnitude of the receptance at 0 Hz, loss factor included", units="m N-1")
    bounds = model.indicators(cases)
    if "relative_energy_error_bound" in bounds:
        bound = bounds["relative_energy_error_bound"][1]
        found["energy_error_bound"] = (("direction", "frequency"), bound.reshape(len(frequency), -1).T, {
            "long_name": "rigorous bound of the relative error in the energy norm", "units": "1"})
    found.attrs = _attributes(arguments, model, scene)
    print(_table(found))
    if arguments.output is not None:
        from rom.datasets.storage import write_netcdf

        write_netcdf(found, arguments.output)
        print(arguments.output)
    if arguments.figure is not None:
        from rom.reporting.figure import Figure
        from rom.reporting.frequency_response import draw_response

        Figure(arguments.figure.name, draw_response(found), "", "").write(arguments.figure.parent)
        print(arguments.figure)
    if arguments.vtu is not None:
        at = sweep_cases(scene, [arguments.at], directions, **options)
        _write_vtu(scene, directions, model.evaluate(at, "field"), arguments.at, arguments.vtu)
        print(arguments.vtu)


def _check(arguments: argparse.Namespace) -> np.ndarray:
    """The frequencies of the sweep [Hz]; ValueError for options that cannot be."""
    import numpy as np

    from rom.scenes.cases import LARGEST

    check_files(arguments, {"output": ".nc", "figure": ".png", "vtu": ".vtu"})
    for name, option in (("first", "from"), ("last", "to"), ("step", "step"), ("at", "at")):
        value = getattr(arguments, name)
        if value is not None and not (math.isfinite(value) and (value > 0 if name == "step" else value >= 0)):
            raise ValueError(f"--{option} is {value:g} Hz, but it must be finite and "
                             f"{'greater than zero' if name == 'step' else 'not negative'}: give a frequency")
        if value is not None and value > LARGEST["Hz"]:
            raise ValueError(f"--{option} is {value:g} Hz, but no body vibrates above {LARGEST['Hz']:g} Hz: lower it")
    if arguments.last < arguments.first:
        raise ValueError(f"--to {arguments.last:g} Hz lies below --from {arguments.first:g} Hz: swap them")
    if (arguments.at is None) != (arguments.vtu is None):
        raise ValueError("--vtu and --at belong together: name the file and the frequency of its field")
    span = (arguments.last - arguments.first) / arguments.step * (1 + 1e-12)
    if not span < MOST_FREQUENCIES:
        raise ValueError(f"steps of {arguments.step:g} Hz are more than {MOST_FREQUENCIES:,}: raise --step")
    count = math.floor(span) + 1
    return arguments.first + arguments.step * np.arange(count)


def _check_method(name: str, scene: LinearScene) -> None:
    from rom.metamodels import applicable, metamodel_class

    known = [method for method, reason in applicable(scene).items()
             if reason is None and not metamodel_class(method, scene).learns]
    if name not in known:
        raise ValueError(f"--method got {name!r}: choose one of {', '.join(known)}")


def _model(arguments: argparse.Namespace, scene: LinearScene, last: float) -> Metamodel:
    from rom.metamodels import create
    from rom.scenes.fingertip_scene import fingertip_of

    settings: dict[str, Any] = {}
    if arguments.method.startswith("modal"):
        from rom.fullorder import sturm_count

        tip = fingertip_of(scene)
        highest = BEYOND * max(last, arguments.at or 0.0)
        settings["modes"] = max(MODES, sturm_count(tip.stiffness, tip.mass, highest) if highest > 0 else 0)
    if arguments.method == "modal-krylov":
        settings["vectors"] = VECTORS
    return create(arguments.method, scene, **settings)


def _attributes(arguments: argparse.Namespace, model: Metamodel, scene: LinearScene) -> dict[str, Any]:
    from rom.comparison.entries import label
    from rom.provenance import stamp
    from rom.scenes.fingertip_scene import fingertip_of

    tip = fingertip_of(scene)
    return stamp(method=label(model.name, model.settings), scene_parameters=scene.to_json(),
                 fingertip=tip.content_hash, formulation=tip.formulation, rear=tip.rear) | {
        "node": int(scene.loads.labels["load_node"][0]), "loss_factor": arguments.loss_factor,
        "force_amplitude": arguments.amplitude, "n_free": scene.n_free, "n_nodes": tip.mesh.n_nodes}


def _table(found: xr.Dataset) -> str:
    """Frequencies line by line, then the peaks."""
    import numpy as np

    frequency, directions = found["frequency"].values, [str(name) for name in found["direction"].values]
    step = -(-len(frequency) // MOST_LINES)
    size = 1e6 * np.abs(found["receptance"].values)
    phase = np.degrees(np.angle(found["driving_point_receptance"].values))
    lines = [" " * 9 + "".join(f"  {name:^30}" for name in directions),
             f"{'f [Hz]':>9}" + f"  {'loaded':>10} {'all':>10} {'phase':>8}" * len(directions),
             " " * 9 + f"  {'[um/N]':>10} {'[um/N]':>10} {'[deg]':>8}" * len(directions)]
    for k in range(0, len(frequency), step):
        lines.append(f"{frequency[k]:>9.2f}" + "".join(
            f"  {size[i, k, 0]:>10.2f} {size[i, k, 1]:>10.2f} {phase[i, k]:>8.1f}" for i in range(len(directions))))
    if step > 1:
        lines.append(f"one of {step} frequencies is shown, of {len(frequency)}; --output keeps all")
    lines += ["loaded, all: mean displacement magnitude of the loaded nodes, of all moving nodes, over the force;",
              "phase: of the loaded nodes along the force", *_peak_lines(found)]
    if "energy_error_bound" in found:
        lines.append(f"certified: at most {float(found['energy_error_bound'].max()):.1e} relative error in energy")
    attrs = found.attrs
    lines.append(f"{attrs['method']}; mesh: {attrs['n_nodes']:,} nodes, {attrs['n_free']:,} free dofs; "
                 f"{attrs['formulation']}; rear {attrs['rear']}; patch about node {attrs['node']}")
    return "\n".join(lines)


def _peak_lines(found: xr.Dataset) -> list[str]:
    from rom.vibration.resonance import peaks

    lines = []
    for direction in found["direction"].values:
        one = found.sel(direction=direction)
        for measure, text in (("excitation", "loaded"), ("whole", "all")):
            curve, static = (abs(one[name].sel(measure=measure)) for name in ("receptance", "static_receptance"))
            listed = [f"{peak.frequency:.1f} Hz ({peak.height / float(static):.2f} times 0 Hz, "
                      f"{1e6 * peak.height * found.attrs['force_amplitude']:.1f} um)"
                      for peak in peaks(found["frequency"], curve)]
            lines.append(f"peaks, {direction}, {text}: {', '.join(listed) or 'none within the sweep'}")
    return lines


def _write_vtu(scene: LinearScene, directions: list[str], values: np.ndarray, at: float, path: Path) -> None:
    from rom.datasets.vtu import write_vtu
    from rom.scenes.fingertip_scene import fingertip_of

    write_vtu(path, fingertip_of(scene).mesh, {
        f"displacement_{name}_{at:g}_Hz_m": field
        for name, field in zip(directions, scene.whole(values), strict=True)})
