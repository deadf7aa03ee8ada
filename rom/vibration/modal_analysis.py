"""The modes of a fingertip with all that is asked about them: parity, shape measures, proofs, a dataset."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from rom.errors import SolverError
from rom.fingertip import Fingertip
from rom.fullorder import Modes, natural_modes, sturm_count
from rom.vibration.mode_shapes import DESCRIPTIONS, MEASURES, descriptions_met, shape_measures
from rom.vibration.parity import parity, pure_parity
from rom.vibration.skin_motion import Floats, Skin, on_all_nodes

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class ModalAnalysis:
    """Modes of one fingertip, each of pure parity.

    Parameters
    ----------
    fingertip : Fingertip
    modes : Modes
    """

    fingertip: Fingertip
    modes: Modes

    @cached_property
    def parity(self) -> NDArray[np.str_]:
        """(m,) ndarray of str : "symmetric" or "antisymmetric"."""
        tip = self.fingertip
        return parity(tip.mesh, tip.free_dofs, tip.mass, self.modes.shape)

    @cached_property
    def measures(self) -> dict[str, Floats]:
        """dict of (m,) ndarray [1] : see `rom.vibration.mode_shapes.MEASURES`."""
        return shape_measures(self.fingertip.mesh, self.fingertip.free_dofs, self.modes.shape)

    @cached_property
    def descriptions_met(self) -> NDArray[np.bool_]:
        """(7, m) ndarray of bool : which published description each mode meets."""
        return descriptions_met(self.measures, self.parity)

    @cached_property
    def field(self) -> Floats:
        """(m, n_nodes, 3) ndarray [-] : shapes on all nodes, largest displacement 1."""
        tip = self.fingertip
        values = np.moveaxis(on_all_nodes(tip.mesh, tip.free_dofs, self.modes.shape), 2, 0)
        return values / np.linalg.norm(values, axis=2).max(axis=1)[:, None, None]

    @cached_property
    def lateral_axis(self) -> Floats:
        """(m, 2) ndarray [m] : x and z of the line about which the skin rotates best; NaN without such motion."""
        skin = Skin(self.fingertip.mesh)
        share, axis = skin.lateral_axis(np.moveaxis(self.field[:, self.fingertip.mesh.skin_nodes], 0, 2))
        return np.where(share > 1e-6, axis, np.nan).T

    @property
    def orthogonality(self) -> dict[str, float]:
        """Largest scaled off-diagonal element |a_ij| / sqrt(a_ii a_jj) of Phi^T K Phi and Phi^T M Phi."""
        return {name: _off_diagonal(self.modes.shape.T @ (matrix @ self.modes.shape))
                for name, matrix in (("stiffness", self.fingertip.stiffness), ("mass", self.fingertip.mass))}

    def to_dataset(self) -> xr.Dataset:
        """Frequencies, parity, measures, descriptions and residuals along ``mode`` (from 1 on)."""
        measures = np.stack(list(self.measures.values()), axis=1)
        one = {"units": "1"}
        return xr.Dataset({
            "natural_frequency": ("mode", self.modes.frequency_hz, {"long_name": "natural frequency", "units": "Hz"}),
            "parity": ("mode", self.parity.astype(object),
                       {"long_name": "parity about the mid-plane y = 0", **one}),
            "shape_measure": (("mode", "measure"), measures, {
                "long_name": "measure of the mode shape", "definition": "; ".join(
                    f"{name}: {words}" for name, words in MEASURES.items()), **one}),
            "description_met": (("mode", "description"), self.descriptions_met.T.astype(np.int8), {
                "long_name": "whether the mode looks as the published mode of this number is described", **one}),
            "lateral_axis": (("mode", "axis"), self.lateral_axis, {
                "long_name": "line parallel to y about which the skin rotates best", "units": "m"}),
            "residual": ("mode", self.modes.residual, {
                "long_name": "||K phi - lambda M phi|| / ||K phi||", **one}),
        }, coords={
            "mode": ("mode", np.arange(1, self.modes.count + 1), {"long_name": "mode number", **one}),
            "measure": ("measure", np.array(list(MEASURES), dtype=object), {"long_name": "name of the measure", **one}),
            "description": ("description", np.array([d.mode for d in DESCRIPTIONS]),
                            {"long_name": "published mode number", **one}),
            "axis": ("axis", np.array(["x", "z"], dtype=object), {"long_name": "coordinate", **one})})


def analyse_modes(tip: Fingertip, count: int) -> ModalAnalysis:
    """The lowest modes, none missed, none of mixed parity.

    Parameters
    ----------
    tip : Fingertip
    count : int
        How many; one or two more are kept where the last would be half of a pair of one frequency.

    Raises
    ------
    ValueError
        For a count out of range.
    SolverError
        If modes cannot be proved complete, or come apart into no parity.
    """
    stiffness, mass = tip.stiffness, tip.mass
    for more in (0, 1, 2):
        modes = natural_modes(stiffness, mass, count=count + more)
        try:
            return ModalAnalysis(tip, pure_parity(modes, tip.mesh, tip.free_dofs, stiffness, mass))
        except SolverError as error:
            log.info("%s", error)
            failure = error
    raise failure


def modes_below(tip: Fingertip, frequency_hz: float) -> int:
    """Number of modes below a frequency, by a Sturm count alone."""
    return sturm_count(tip.stiffness, tip.mass, frequency_hz)


def _off_diagonal(gram: NDArray[Any]) -> float:
    scale = np.sqrt(np.outer(np.diag(gram), np.diag(gram)))
    return float(np.max(np.abs(gram / scale - np.eye(len(gram)))))
