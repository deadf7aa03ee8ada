"""`rom body`: what a model of another program holds; kept as one file, or reduced and taken to another program."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rom.commands.files import check_files

if TYPE_CHECKING:
    from rom.bodies import Body, Material


def add(commands: Any) -> None:
    """Add the sub-command."""
    parser = commands.add_parser("body", help="read a body from matrices or a mesh: summary, one file, exports")
    parser.add_argument("file", type=Path, metavar="FILE", help="Matrix Market, .npz, .mat, Harwell-Boeing, Abaqus "
                        ".mtx, Ansys .full, Nastran .pch or .op4, CalculiX .sti, a mesh, or a body's .nc")
    matrices = parser.add_argument_group("matrices")
    matrices.add_argument("--stiffness", action="append", default=[], metavar="[REGION=]NAME",
                          help="which matrix it is, where the file does not say: NAME, -NAME, 2*NAME, real(NAME), "
                               "imag(NAME), or another file; once for each region")
    for role, words in (("mass", "likewise"), ("viscous", "viscous damping, likewise"),
                        ("loss", "imaginary part of the stiffness, likewise")):
        matrices.add_argument(f"--{role}", metavar="NAME", help=words)
    matrices.add_argument("--mesh", type=Path, metavar="FILE", help="nodes and cells behind the matrices")
    mesh = parser.add_argument_group("meshes")
    mesh.add_argument("--material", action="append", default=[], metavar="[REGION=]E,NU,RHO[,ETA]",
                      help="Young's modulus [Pa], Poisson's ratio, density [kg/m3], loss factor; once for each region")
    mesh.add_argument("--formulation", choices=("full", "b-bar"), help="default: b-bar for linear hexahedra")
    mesh.add_argument("--scale", type=float, metavar="M", help="the mesh's unit of length in metres (default 1)")
    mesh.add_argument("--region-data", metavar="NAME", help="cell data that tells regions apart")
    parser.add_argument("--hold", action="append", default=[], metavar="PLACE",
                        help="a named set, a node, a degree of freedom such as `17 z`, or a plane such as z=min; "
                             "`PLACE:x,y` holds some components")
    parser.add_argument("--name", help="default: the file's")
    parser.add_argument("--output", type=Path, metavar="FILE.nc", help="keep the body as one file")
    out = parser.add_argument_group("exports")
    out.add_argument("--superelement", type=Path, metavar="FILE",
                     help="Craig-Bampton reduction as .pch (Nastran), .inp (Abaqus), .mtx (Matrix Market) or .nc")
    out.add_argument("--interface", action="append", default=[], metavar="PLACE", help="what the superelement keeps")
    out.add_argument("--state-space", type=Path, metavar="FILE", help="A, B, C, D as .npz or .mat")
    out.add_argument("--fmu", type=Path, metavar="FILE.fmu", help="the same as a functional mock-up unit (needs a C "
                                                                  "compiler)")
    out.add_argument("--inputs", action="append", default=[], metavar="PLACE", help="where forces act")
    out.add_argument("--outputs", action="append", default=[], metavar="PLACE", help="displacements that are wanted")
    out.add_argument("--loss-factor", type=float, default=0.0, help="of the whole body in time (default 0)")
    out.add_argument("--band", type=float, metavar="HZ", help="answers are wanted up to this frequency")
    out.add_argument("--modes", type=int, metavar="N", help="number of modes, instead of --band")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Read, print, write."""
    check_files(arguments, {"output": ".nc", "fmu": ".fmu"})
    _check_exports(arguments)
    from rom.bodies import read_body

    options: dict[str, Any] = {name: value for name, value in (
        ("stiffness", _by_region(arguments.stiffness)), ("mass", arguments.mass), ("viscous", arguments.viscous),
        ("loss", arguments.loss), ("mesh", arguments.mesh), ("materials", _materials(arguments.material)),
        ("formulation", arguments.formulation), ("scale", arguments.scale), ("region_data", arguments.region_data),
        ("name", arguments.name)) if value is not None}
    body = read_body(arguments.file, held=arguments.hold, **options)
    print(summary(body))
    if arguments.output is not None:
        body.write(arguments.output)
        print(arguments.output)
    if arguments.superelement is not None:
        _superelement(body, arguments)
    if arguments.state_space is not None or arguments.fmu is not None:
        _in_time(body, arguments)


def summary(body: Body) -> str:
    """What a body holds, what reading changed, what to do next."""
    model, grid = body.model, body.grid
    lines = [f"{body.name}: {model.n:,} degrees of freedom ({', '.join(map(str, body.dof_names[:3]))} ...)",
             f"  stiffness   {model.stiffness.nnz:,} entries" + (
                 f" in the regions {', '.join(body.stiffness_by_region)}" if body.stiffness_by_region else "")]
    if body.has_mass:
        lines.append(f"  mass        {model.mass.nnz:,} entries, {model.mass.diagonal().sum():.6g} kg on the diagonal")
    damping = [words for words, there in (("loss stiffness", model.loss_stiffness is not None),
                                          ("viscous", body.viscous is not None)) if there]
    lines.append(f"  damping     {', '.join(damping) or 'none of its own'}")
    if grid is not None:
        low, high = (" ".join(f"{x:.4g}" for x in end(axis=0)) for end in (grid.nodes.min, grid.nodes.max))
        cells = ", ".join(f"{len(cells):,} {kind}" for kind, cells in grid.cells.items()) or "no cells"
        lines += [f"  mesh        {grid.n_node:,} nodes from {low} to {high} m, {cells}",
                  f"  regions     {', '.join(grid.region_names) or 'none'}",
                  f"  sets        {', '.join(grid.sets) or 'none'}"]
    lines += [f"  content     {body.content_hash[:24]}", *(f"note: {note}" for note in body.notes),
              *(f"doubt: {doubt}" for doubt in body.doubts)]
    if grid is None:
        lines.append("hint: there are no places; give --mesh for pictures and for names such as z=min")
    return "\n".join(lines)


def _by_region(words: list[str]) -> str | dict[str, str] | None:
    if not words or (len(words) == 1 and "=" not in words[0]):
        return words[0] if words else None
    parts = [word.partition("=") for word in words]
    if any(not (name and sign and matrix) for name, sign, matrix in parts):
        raise ValueError(f"--stiffness got {', '.join(map(repr, words))}: give several as REGION=NAME, one each")
    return {name.strip(): matrix.strip() for name, _, matrix in parts}


def _materials(words: list[str]) -> Material | dict[str, Material] | None:
    from rom.bodies import Material

    found: dict[str, Material] = {}
    for word in words:
        region, sign, numbers = word.rpartition("=")
        try:
            values = [float(number) for number in numbers.split(",")]
        except ValueError:
            values = []
        if len(values) not in (3, 4) or (not sign and len(words) > 1):
            raise ValueError(f"--material got {word!r}: give [REGION=]E,NU,RHO or E,NU,RHO,ETA in Pa and kg/m3, as in "
                             "bone=17e9,0.3,1900; several only with their regions")
        if not sign:
            return Material(*values)
        found[region.strip()] = Material(*values)
    return found or None


def _check_exports(arguments: argparse.Namespace) -> None:
    """Refuse what is missing before any work."""
    in_time = arguments.state_space is not None or arguments.fmu is not None
    if arguments.superelement is not None and not arguments.interface:
        raise ValueError("--superelement was asked for and no --interface: name what it keeps, such as z=max")
    if in_time and not (arguments.inputs and arguments.outputs):
        raise ValueError("--state-space and --fmu need --inputs and --outputs: name where forces act, what is wanted")
    if (arguments.superelement is not None or in_time) and (arguments.band is None) == (arguments.modes is None):
        raise ValueError("an export needs --band HZ or --modes N, and one of them alone")
    for name, endings in (("superelement", (".pch", ".inp", ".mtx", ".nc")), ("state_space", (".npz", ".mat"))):
        path = getattr(arguments, name)
        if path is not None and path.suffix not in endings:
            raise ValueError(f"--{name.replace('_', '-')} got {str(path)!r}: its name must end in {', '.join(endings)}")


def _superelement(body: Body, arguments: argparse.Namespace) -> None:
    from rom.bodies.export import craig_bampton, write_matrices

    found = craig_bampton(body, arguments.interface, modes=arguments.modes, band=arguments.band)
    error = ""
    if arguments.band is not None:
        error = f", interface responses within {found.error:.1e} up to {arguments.band:g} Hz"
    print(f"superelement: {len(found.interface)} interface degrees of freedom and "
          f"{found.body.model.n - len(found.interface)} modes{error}")
    if arguments.superelement.suffix == ".nc":
        found.body.write(arguments.superelement)
        print(arguments.superelement)
    else:
        print(*write_matrices(found.body, arguments.superelement), sep="\n")


def _in_time(body: Body, arguments: argparse.Namespace) -> None:
    from rom.bodies.export import state_space, write_fmu

    # modes up to twice the band; what lies above is in the static answer
    below = None if arguments.band is None else 2 * arguments.band
    system = state_space(body, arguments.inputs, arguments.outputs, modes=arguments.modes, below_hz=below,
                         loss_factor=arguments.loss_factor)
    print(f"state space: {len(system.inputs)} forces, {len(system.outputs)} displacements, {len(system.a)} states")
    if arguments.state_space is not None:
        system.write(arguments.state_space)
        print(arguments.state_space)
    if arguments.fmu is not None:
        print(write_fmu(system, arguments.fmu))
