"""Archives of NumPy and SciPy (.npz) and files of MATLAB (.mat)."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np

from rom.bodies.readers.found import FoundMatrices, as_square, square_ones


def read(path: Path) -> FoundMatrices:
    """Every square matrix of the file by its name; a sparse matrix of SciPy by the file's name."""
    return _read_mat(path) if path.suffix.lower() == ".mat" else _read_npz(path)


def _read_npz(path: Path) -> FoundMatrices:
    import scipy.sparse as sp

    try:
        with np.load(path, allow_pickle=False) as archive:
            if "format" in archive.files and "data" in archive.files:
                return FoundMatrices("SciPy archive", {path.name: as_square(sp.load_npz(path), path.name)})
            matrices = square_ones((name, archive[name]) for name in archive.files)
    except (ValueError, zipfile.BadZipFile, EOFError) as error:
        raise ValueError(f"{path.name} is no readable archive of arrays ({error}): write it with "
                         "scipy.sparse.save_npz, or numpy.savez of plain arrays") from error
    return FoundMatrices("NumPy archive", matrices)


def _read_mat(path: Path) -> FoundMatrices:
    import scipy.io

    try:
        content = scipy.io.loadmat(path)
    except NotImplementedError as error:
        raise ValueError(f"{path.name} is a MATLAB 7.3 file (HDF5): save it once more with save(..., '-v7')") from error
    except Exception as error:  # scipy lets out whatever its parser meets
        raise ValueError(f"{path.name} is no readable MATLAB file ({error}): write it again") from error
    return FoundMatrices("MATLAB", square_ones((name, one) for name, one in content.items() if name[:2] != "__"))
