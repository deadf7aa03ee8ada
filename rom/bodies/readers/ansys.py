"""Ansys: the .full file, by ansys-mapdl-reader. Held degrees of freedom are in it as empty rows."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import scipy.sparse as sp

from rom.bodies.readers.found import FoundMatrices, needed


def read(path: Path) -> FoundMatrices:
    """Stiffness and mass, one triangle stored, in the order of the file's equations."""
    reader = needed("ansys.mapdl.reader.full", "ansys-mapdl-reader", "ansys", "an Ansys .full file")
    try:
        labels, stiffness, mass = reader.FullFile(path).load_km(as_sparse=True, sort=False)
    except NotImplementedError as error:
        raise ValueError(f"{path.name} cannot be read ({error}): solve once more with LUMPM,OFF and a symmetric "
                         "solver, or write the matrices with *SMAT and *EXPORT as Matrix Market") from error
    except Exception as error:  # whatever its parser meets
        raise ValueError(f"{path.name} is no readable .full file ({error}): write it again") from error
    matrices = {"stiffness": sp.csr_array(stiffness)} | ({} if mass is None else {"mass": sp.csr_array(mass)})
    return FoundMatrices("Ansys .full", matrices, np.asarray(labels, dtype=np.int64) + [0, 1],
                         {name: name for name in matrices})
