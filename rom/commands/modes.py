"""`rom modes`: natural modes of a fingertip as a table, and as files on demand."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rom.checks import whole_number
from rom.commands.files import check_files
from rom.commands.fingertip_options import add_fingertip_options, fingertip_from

if TYPE_CHECKING:
    import numpy as np

    from rom.vibration.modal_analysis import ModalAnalysis

DEFAULT_COUNT = 8
SHOWN_MEASURES = {"torsion": "torsion", "lateral_rotation": "rotation", "contraction": "contraction",
                  "lower_normal": "lower normal", "vertical_antiphase": "vertical", "side_diagonal": "diagonal"}
"""Columns of the terminal's table; the file holds all measures."""


def add(commands: Any) -> None:
    """Add the sub-command."""
    parser = commands.add_parser("modes", help="natural modes: frequency, parity, what each looks like")
    add_fingertip_options(parser)
    how_many = parser.add_mutually_exclusive_group()
    how_many.add_argument("--count", type=int, metavar="N", help=f"how many modes (default {DEFAULT_COUNT})")
    how_many.add_argument("--below", type=float, metavar="HZ", help="all modes below this frequency")
    for option, metavar, words in (("--output", "FILE.nc", "write frequencies, measures and shapes on all nodes"),
                                   ("--figure", "FILE.png", "draw the shapes on the skin"),
                                   ("--vtu", "FILE.vtu", "write the shapes for ParaView")):
        parser.add_argument(option, type=Path, metavar=metavar, help=words)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Compute, print, write."""
    check_files(arguments, {"output": ".nc", "figure": ".png", "vtu": ".vtu"})
    tip = fingertip_from(arguments)
    count = _count(arguments, tip)
    from rom.vibration.modal_analysis import analyse_modes

    found = analyse_modes(tip, count)
    print(_table(found, arguments.rear))
    for write, path in ((_write_dataset, arguments.output), (_write_figure, arguments.figure),
                        (_write_vtu, arguments.vtu)):
        if path is not None:
            write(found, path)
            print(path)


def _count(arguments: argparse.Namespace, tip: Any) -> int:
    if arguments.below is None:
        return whole_number("--count", DEFAULT_COUNT if arguments.count is None else arguments.count, 1)
    from rom.vibration.modal_analysis import modes_below

    if not arguments.below > 0:
        raise ValueError(f"--below is {arguments.below:g} Hz, but it must be greater than zero: give a frequency")
    count = modes_below(tip, arguments.below)
    if not count:
        raise ValueError(f"no natural mode lies below {arguments.below:g} Hz: raise --below, or ask by --count")
    return count


def _table(found: ModalAnalysis, rear: str) -> str:
    """Modes line by line; published frequencies belong to the rear-free study."""
    from rom.vibration.published import published_frequencies

    printed = published_frequencies() if rear == "free" else {}
    names = [*SHOWN_MEASURES.values()]
    lines = [f"{'mode':>4} {'f [Hz]':>9} {'published':>9}  {'parity':<13} {'looks as':<8} "
             + " ".join(f"{name:>{max(6, len(name))}}" for name in names)]
    met = found.descriptions_met
    for k, frequency in enumerate(found.modes.frequency_hz):
        published = f"{printed[k + 1]:.1f}" if k + 1 in printed else "-"
        fits = ",".join(str(i + 1) for i in range(len(met)) if met[i, k]) or "-"
        values = " ".join(f"{found.measures[key][k]:>{max(6, len(name))}.2f}" for key, name in SHOWN_MEASURES.items())
        lines.append(f"{k + 1:>4} {frequency:>9.2f} {published:>9}  {found.parity[k]:<13} {fits:<8} {values}")
    modes, tip = found.modes, found.fingertip
    lines += ["'looks as' lists published modes whose description is met; the last columns are measures of the shape",
              f"no mode is missing: {modes.sturm_count} below {modes.sturm_shift_hz:.2f} Hz by a Sturm count",
              f"mesh: {tip.mesh.n_nodes:,} nodes, {len(tip.free_dofs):,} free dofs; {tip.formulation}; rear {tip.rear}"]
    if printed and tip.formulation != "full":
        lines.append("published frequencies are those of full integration: --formulation full compares like with like")
    return "\n".join(lines)


def _write_dataset(found: ModalAnalysis, path: Path) -> None:
    import numpy as np

    from rom.datasets.storage import write_netcdf
    from rom.provenance import stamp

    tip = found.fingertip
    data = found.to_dataset().assign(
        mode_shape=(("mode", "node", "component"), found.field, {
            "long_name": "mode shape, largest displacement 1", "units": "1"}),
        sturm_count=((), found.modes.sturm_count, {
            "long_name": "natural modes below sturm_shift by the inertia of K - omega^2 M", "units": "1"}),
        sturm_shift=((), found.modes.sturm_shift_hz, {"long_name": "where the Sturm count was taken", "units": "Hz"}),
        hexahedra=(("element", "corner"), tip.mesh.hexahedra.astype(np.int32), {
            "long_name": "nodes of each element, VTK order", "units": "1"}),
        tissue=("element", tip.mesh.tissue.astype(np.int8), {"long_name": "tissue id", "units": "1"}))
    for i, axis in enumerate("xyz"):
        data[f"node_{axis}"] = ("node", tip.mesh.nodes[:, i], {"long_name": f"{axis} of the nodes", "units": "m"})
    data.coords["component"] = ("component", np.array(["x", "y", "z"], dtype=object), {
        "long_name": "displacement component", "units": "1"})
    data.attrs = stamp(fingertip=tip.content_hash, formulation=tip.formulation, rear=tip.rear)
    write_netcdf(data, path, compress=True)


def _skin(found: ModalAnalysis) -> tuple[np.ndarray, np.ndarray]:
    mesh = found.fingertip.mesh
    return mesh.nodes[mesh.skin_nodes] * 1e3, mesh.skin_quads


def _write_figure(found: ModalAnalysis, path: Path) -> None:
    from rom.reporting.figure import Figure
    from rom.reporting.mode_shapes import Shape, magnitude_sheet

    skin = found.field[:, found.fingertip.mesh.skin_nodes]
    shapes = [Shape(f"mode {k + 1}: {frequency:.1f} Hz\n({found.parity[k]})", skin[k])
              for k, frequency in enumerate(found.modes.frequency_hz)]
    tip = found.fingertip
    first, last = found.modes.frequency_hz[[0, -1]]
    title = f"Modes 1 to {len(shapes)}, {first:.1f} to {last:.1f} Hz ({tip.formulation}, rear {tip.rear})"
    figure = magnitude_sheet(title, *_skin(found), shapes)
    Figure(path.name, figure, "", "").write(path.parent)


def _write_vtu(found: ModalAnalysis, path: Path) -> None:
    from rom.datasets.vtu import write_vtu

    write_vtu(path, found.fingertip.mesh, {f"mode_{k + 1}_{frequency:.1f}_Hz": field for k, (frequency, field) in
                                           enumerate(zip(found.modes.frequency_hz, found.field, strict=True))})
