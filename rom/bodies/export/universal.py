"""Frequency responses to and from universal files: dataset 58, by pyuff.

A response is written for each pair of degrees of freedom. ``17 z`` becomes node 17, direction +Z; a name without node
and component is kept as the entity's name, with a node number of its own.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from rom.bodies.export.matrices import numbered
from rom.bodies.readers.found import COMPONENTS, needed
from rom.files import whole_file

KINDS = {"receptance": (8, "m/N"), "mobility": (11, "m/s/N"), "accelerance": (12, "m/s2/N")}
"""Number of the data type of the response, and units, by what a response is called; forces are of type 13."""
FORCE = 13
FREQUENCY_RESPONSE = 4


def write_universal(path: str | Path, frequency: ArrayLike, response: ArrayLike, outputs: list[str],
                    inputs: list[str], *, kind: str = "receptance") -> None:
    """Write frequency responses as text.

    Parameters
    ----------
    path : str or Path
        Usually ends in ``.uff`` or ``.unv``.
    frequency : (k,) array_like [Hz]
    response : (k, o, i) array_like of complex
    outputs, inputs : list of str
        Names of responses and forces.
    kind : {"receptance", "mobility", "accelerance"}

    Raises
    ------
    ValueError
        For another kind or shape, or without pyuff.
    OSError
        Where the file cannot be written.
    """
    pyuff = needed("pyuff", "pyuff", "universal", "a universal file")
    x, values = np.asarray(frequency, dtype=float), np.asarray(response, dtype=complex)
    if kind not in KINDS:
        raise ValueError(f"kind={kind!r} is unknown: choose one of {', '.join(KINDS)}")
    if values.shape != (len(x), len(outputs), len(inputs)):
        raise ValueError(f"the responses have shape {values.shape}: give ({len(x)}, {len(outputs)}, {len(inputs)}), "
                         "one for each frequency, output and input")
    names = list(dict.fromkeys([*outputs, *inputs]))
    labels, given = numbered(np.array(names))
    place = dict(zip(names, labels.tolist(), strict=True))
    step = np.diff(x)
    even = len(x) > 1 and np.allclose(step, step[0], rtol=1e-9)
    sets = []
    for i, force in enumerate(inputs):
        for o, output in enumerate(outputs):
            sets.append({
                "type": 58, "func_type": FREQUENCY_RESPONSE, "id1": f"{output} / {force}"[:80],
                "rsp_ent_name": output[:10] if output in given else "NONE", "rsp_node": place[output][0],
                "rsp_dir": place[output][1], "ref_ent_name": force[:10] if force in given else "NONE",
                "ref_node": place[force][0], "ref_dir": place[force][1], "ord_data_type": 6, "num_pts": len(x),
                "abscissa_spacing": int(even), "abscissa_min": x[0], "abscissa_inc": step[0] if even else 0.0,
                "abscissa_spec_data_type": 18, "ordinate_spec_data_type": KINDS[kind][0],
                "orddenom_spec_data_type": FORCE, "x": x, "data": values[:, o, i]})
    with whole_file(path) as temporary:
        pyuff.UFF(str(temporary)).write_sets(sets, "overwrite")


def read_universal(path: str | Path) -> xr.Dataset:
    """Read frequency responses, measured or computed.

    Returns
    -------
    xr.Dataset
        ``response`` (frequency, output, input), complex; its kind and units as attributes. NaN where a pair was not
        measured.

    Raises
    ------
    ValueError
        Where the file holds none, or responses over different frequencies or of different kinds.
    """
    path = Path(path)
    pyuff = needed("pyuff", "pyuff", "universal", "a universal file")
    if not path.is_file():
        raise ValueError(f"{path} does not exist: correct the path")
    try:
        file = pyuff.UFF(str(path))
        sets = [file.read_sets(i) for i in range(file.get_n_sets())]
    except Exception as error:  # whatever its parser meets
        raise ValueError(f"{path.name} is no readable universal file ({error}): write it again") from error
    found = [one for one in sets if one.get("type") == 58 and one.get("func_type") == FREQUENCY_RESPONSE]
    if not found:
        raise ValueError(f"{path.name} holds no frequency response (dataset 58 of function type 4): export those")
    x = np.asarray(found[0]["x"])
    if any(len(one["x"]) != len(x) or not np.allclose(one["x"], x) for one in found):
        raise ValueError(f"{path.name} holds responses over different frequencies: export those of one measurement")
    kinds = {one.get("ordinate_spec_data_type") for one in found}
    if len(kinds) > 1:
        raise ValueError(f"{path.name} holds responses of different kinds, data types {sorted(kinds)}: export one kind")
    outputs, inputs = ([_name(one, end) for one in found] for end in ("rsp", "ref"))
    rows, columns = list(dict.fromkeys(outputs)), list(dict.fromkeys(inputs))
    values = np.full((len(x), len(rows), len(columns)), np.nan + 0j)
    for one, output, force in zip(found, outputs, inputs, strict=True):
        values[:, rows.index(output), columns.index(force)] = one["data"]
    kind, units = next(((name, units) for name, (number, units) in KINDS.items() if number in kinds), ("response", "1"))
    return xr.Dataset({"response": (("frequency", "output", "input"), values, {"long_name": kind, "units": units})},
                      coords={"frequency": ("frequency", x, {"long_name": "frequency", "units": "Hz"}),
                              "output": rows, "input": columns}, attrs={"kind": kind})


def _name(one: dict[str, Any], end: str) -> str:
    """``17 z``, or the entity's name; a negative direction is told by a sign."""
    entity, node, direction = str(one.get(f"{end}_ent_name", "NONE")).strip(), one[f"{end}_node"], one[f"{end}_dir"]
    if direction == 0:
        return entity if entity not in ("", "NONE") else str(node)
    return f"{node} {'-' if direction < 0 else ''}{COMPONENTS[abs(direction)]}"
