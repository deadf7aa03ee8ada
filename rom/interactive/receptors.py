"""Strain where Meissner's corpuscles lie, shown at the pad's nodes.

The measure is the largest principal strain at the instant of the cycle at which the strain energy density is largest,
on the dermal side of the epidermis-dermis border. It is taken below the centres of the pad's quadrilaterals, where a
trilinear element is accurate, and averaged at each node over the quadrilaterals that meet there.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from rom.fingertip import Fingertip, strain
from rom.fingertip.mesh import MILLIMETRE
from rom.fingertip.strain_measures import principal_strains, strain_at_peak


class ReceptorStrain:
    """Strain at receptor depth of one fingertip.

    Parameters
    ----------
    tip : Fingertip
    """

    def __init__(self, tip: Fingertip) -> None:
        mesh, anatomy = tip.mesh, tip.anatomy
        self.depth = anatomy.stratum_corneum_thickness + anatomy.epidermis_thickness
        """[mm] below the skin, along its normal."""
        quads = strain.pad_quads(mesh)
        points = strain.points_at_depth(mesh, self.depth * MILLIMETRE, "deep", quads)
        self._operator = strain.operator_at(tip, points)[:, tip.free_dofs]
        self._moduli = points.moduli(tip)
        corners = np.searchsorted(mesh.pad_nodes, mesh.skin_quads[quads])
        rows = np.repeat(np.arange(len(quads)), 4)
        touching = sparse.csr_array((np.ones(corners.size), (corners.ravel(), rows)),
                                    shape=(len(mesh.pad_nodes), len(quads)))
        count = touching.sum(axis=1)
        self._average = sparse.diags_array(np.divide(1.0, count, out=np.zeros(len(count)), where=count > 0)) @ touching
        self._alone = count == 0

    def at_quads(self, values: np.ndarray) -> np.ndarray:
        """(n_quad,) ndarray: strain below the centres of the pad's quadrilaterals, of an answer (n_free,) [m]."""
        found = strain.apply(self._operator, values)
        return principal_strains(strain_at_peak(found, *self._moduli))[..., 0]

    def at_pad_nodes(self, values: np.ndarray) -> np.ndarray:
        """(n_pad,) ndarray: the same at the pad's nodes; NaN where no quadrilateral of the pad meets a node."""
        found = self._average @ self.at_quads(values)
        found[self._alone] = np.nan
        return found
