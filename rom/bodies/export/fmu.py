"""A state space as a functional mock-up unit: FMI 2.0, model exchange and co-simulation, C without a run-time library.

A co-simulation step takes forces as constant over the step and is exact for those (`fmu.c`). The sources lie in the
unit, so that it can be compiled for another system.
"""

from __future__ import annotations

import hashlib
import os
import platform
import shutil
import subprocess
import tempfile
import zipfile
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from rom.bodies.export.state_space import StateSpace
from rom.errors import RomError
from rom.files import whole_file
from rom.provenance import stamp

SOURCE = Path(__file__).with_name("fmu.c")
SYSTEMS = {"Linux": ("linux64", ".so", ["-fPIC", "-shared"]), "Darwin": ("darwin64", ".dylib", ["-dynamiclib"]),
           "Windows": ("win64", ".dll", ["-shared"])}
MODEL = "body"
"""Name of the library in the unit."""


def write_fmu(system: StateSpace, path: str | Path, *, compiler: str | None = None) -> Path:
    """Compile a unit for this machine's system.

    Parameters
    ----------
    system : StateSpace
    path : str or Path
        Ends in ``.fmu``.
    compiler : str, optional
        Default: ``$CC``, or cc, gcc or clang, the first that there is.

    Returns
    -------
    Path
        Of the unit.

    Raises
    ------
    ValueError
        For another ending, or where there is no compiler.
    RomError
        Where the compiler fails.
    OSError
        Where the unit cannot be written.
    """
    path = Path(path)
    if path.suffix != ".fmu":
        raise ValueError(f"{path.name} ends in {path.suffix or 'nothing'}: the name of a unit ends in .fmu")
    names = [given] if (given := compiler or os.environ.get("CC")) else ["cc", "gcc", "clang"]
    command = next(filter(shutil.which, names), None)
    if command is None:
        raise ValueError(f"there is no C compiler {' or '.join(names)}: install one, or name it by the variable CC")
    if platform.system() not in SYSTEMS:
        raise ValueError(f"units for {platform.system()} cannot be made: make it on {', '.join(SYSTEMS)}")
    folder, ending, flags = SYSTEMS[platform.system()]
    numbers = b"".join(np.ascontiguousarray(part).tobytes() for part in (system.a, system.b, system.c, system.d))
    guid = "{" + hashlib.sha256(numbers + repr((system.inputs, system.outputs)).encode()).hexdigest()[:32] + "}"
    header = _header(system, guid)
    with tempfile.TemporaryDirectory() as place:
        shutil.copy(SOURCE, place)
        Path(place, "model.h").write_text(header)
        done = subprocess.run([command, "-O2", "-std=c99", "-fvisibility=hidden", *flags, "-o", f"{MODEL}{ending}",
                               SOURCE.name, "-lm"], cwd=place, capture_output=True, text=True)
        if done.returncode:
            raise RomError(f"{command} could not compile the unit: {done.stderr.strip()[-300:]}")
        library = Path(place, f"{MODEL}{ending}").read_bytes()
    with whole_file(path) as temporary, zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as unit:
        unit.writestr("modelDescription.xml", _description(system, guid))
        unit.writestr(f"binaries/{folder}/{MODEL}{ending}", library)
        unit.writestr(f"sources/{SOURCE.name}", SOURCE.read_text())
        unit.writestr("sources/model.h", header)
    return path


def _header(system: StateSpace, guid: str) -> str:
    def array(name: str, matrix: np.ndarray) -> str:
        return f"static const double {name}[] = {{{', '.join(map(repr, np.ravel(matrix).tolist()))}}};"

    fastest = np.abs(np.linalg.eigvals(system.a)).max()
    nominal = float(np.abs(system.b).max() / fastest) or 1.0  # what a unit force moves the fastest state by
    counts = {"INPUTS_COUNT": len(system.inputs), "OUTPUTS_COUNT": len(system.outputs), "STATES_COUNT": len(system.a)}
    return "\n".join([f'#define GUID "{guid}"', f"#define NOMINAL {nominal!r}",
                      *(f"#define {name} {count}" for name, count in counts.items()),
                      array("A", system.a), array("B", system.b), array("C", system.c), array("D", system.d)]) + "\n"


def _description(system: StateSpace, guid: str) -> str:
    """modelDescription.xml: forces, displacements, states and their derivatives, in the order of the references."""
    first_state = len(system.inputs) + len(system.outputs)
    count = len(system.a)
    variables = [_variable(i, f"force {name}", 'causality="input" variability="continuous"', 'start="0" unit="N"')
                 for i, name in enumerate(system.inputs)]
    variables += [_variable(len(variables) + i, f"displacement {name}", 'causality="output" variability="continuous"',
                            'unit="m"') for i, name in enumerate(system.outputs)]
    variables += [_variable(first_state + i, f"state {i + 1}",
                            'causality="local" variability="continuous" initial="exact"', 'start="0"')
                  for i in range(count)]
    variables += [_variable(first_state + count + i, f"derivative of state {i + 1}",
                            'causality="local" variability="continuous"', f'derivative="{first_state + i + 1}"')
                  for i in range(count)]
    outputs = "".join(f'<Unknown index="{len(system.inputs) + i + 1}"/>' for i in range(len(system.outputs)))
    slopes = "".join(f'<Unknown index="{first_state + count + i + 1}"/>' for i in range(count))
    said = stamp()
    states = 'canGetAndSetFMUstate="true" canSerializeFMUstate="true" providesDirectionalDerivative="true"'
    files = f'<SourceFiles><File name="{SOURCE.name}"/></SourceFiles>'
    return "\n".join([
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<fmiModelDescription fmiVersion="2.0" modelName={quoteattr(system.name)} guid="{guid}" '
        f'generationTool={quoteattr(said["software"])} variableNamingConvention="flat" numberOfEventIndicators="0" '
        'description="Linear body by its natural modes: forces in, displacements out. A co-simulation step is exact '
        'for forces that are constant over it.">',
        f'<ModelExchange modelIdentifier="{MODEL}" {states}>{files}</ModelExchange>',
        f'<CoSimulation modelIdentifier="{MODEL}" canHandleVariableCommunicationStepSize="true" {states}>{files}'
        '</CoSimulation>',
        '<UnitDefinitions><Unit name="N"><BaseUnit kg="1" m="1" s="-2"/></Unit><Unit name="m"><BaseUnit m="1"/></Unit>'
        '</UnitDefinitions>',
        "<ModelVariables>", *variables, "</ModelVariables>",
        f"<ModelStructure><Outputs>{outputs}</Outputs><Derivatives>{slopes}</Derivatives>"
        f"<InitialUnknowns>{outputs}{slopes}</InitialUnknowns></ModelStructure>", "</fmiModelDescription>"])


def _variable(reference: int, name: str, kind: str, real: str) -> str:
    return f'<ScalarVariable name={quoteattr(name)} valueReference="{reference}" {kind}><Real {real}/></ScalarVariable>'
