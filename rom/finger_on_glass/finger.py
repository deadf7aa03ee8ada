"""The finger on the plate as a system of equations: unknowns, residual, tangent.

Unknowns, in this order: displacements of all nodes (x and y in turn) [mm], the out-of-plane stretch, the plate's height
[mm]; beside them one pressure an element, updated linearly. Forces are per mm of the finger's effective length.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from rom.checks import real_number, shown
from rom.finger_on_glass.contact import ContactHistory, ContactResponse, Glass, contact_response
from rom.finger_on_glass.element import element_response, shape_gradients
from rom.finger_on_glass.linear_solver import PatternedLU
from rom.finger_on_glass.section import Section, SectionMesh, mesh_section
from rom.finger_on_glass.tissue import Tissue, fibre_directions


@dataclass(frozen=True)
class OutOfPlane:
    """What stands for the third dimension; both are assumptions, since the publication does not give them.

    Parameters
    ----------
    stiffness : float [N]
        Axial force for each unit of out-of-plane strain, beside the tissue's own: generalized plane strain. Infinite:
        plane strain.
    effective_length : float [mm]
        By which forces of the section are multiplied.

    Raises
    ------
    ValueError
    """

    stiffness: float = 100.0
    effective_length: float = 10.0

    def __post_init__(self) -> None:
        if not isinstance(self.stiffness, float) or self.stiffness != np.inf:
            object.__setattr__(self, "stiffness", real_number("out-of-plane stiffness", self.stiffness, 0.0, unit="N"))
        object.__setattr__(self, "effective_length", real_number("effective_length", self.effective_length, above=0.0,
                                                                 most=1e4, unit="mm"))


@dataclass(frozen=True, eq=False)
class State:
    """An equilibrium, with all that the next one depends on."""

    displacement: np.ndarray
    """(n_node, 2) ndarray [mm]"""
    stretch_z: float
    plate_y: float
    plate_x: float
    pressure: np.ndarray
    """(n_quad,) ndarray [MPa], positive where stretched."""
    contact: ContactHistory


@dataclass(frozen=True, eq=False)
class Residual:
    """The system at a trial state."""

    usable: bool
    force: np.ndarray
    """(n,) ndarray [N/mm]: residual with the elements' own pressures."""
    condensed: np.ndarray
    """(n,) ndarray [N/mm]: right-hand side of Newton's step, pressures eliminated."""
    volume_error: float
    """Largest difference between an element's dilatation and that which its pressure stands for."""
    contact: ContactResponse
    dilatation: np.ndarray
    dilatation_force: np.ndarray
    energy: float
    """Of the tissue [N]: N mm for each mm of length."""
    largest_fibre: float


@dataclass(frozen=True)
class Finger:
    """A section on a plate: geometry, tissue, mesh.

    Parameters
    ----------
    section : Section
    tissue : Tissue
    plate : Glass
    out_of_plane : OutOfPlane
    rays, layers : int
        Elements around the bone and from bone to skin.
    """

    section: Section = field(default_factory=Section)
    tissue: Tissue = field(default_factory=Tissue)
    plate: Glass = field(default_factory=Glass)
    out_of_plane: OutOfPlane = field(default_factory=OutOfPlane)
    rays: int = 120
    layers: int = 12

    def __post_init__(self) -> None:
        for name, kind in (("section", Section), ("tissue", Tissue), ("plate", Glass), ("out_of_plane", OutOfPlane)):
            if not isinstance(getattr(self, name), kind):
                raise ValueError(f"{name} is {shown(getattr(self, name))}: build one with the class {kind.__name__}")

    # ---- geometry -------------------------------------------------------------------------------------------

    @cached_property
    def mesh(self) -> SectionMesh:
        return mesh_section(self.section, self.rays, self.layers)

    @cached_property
    def shape_functions(self) -> tuple[np.ndarray, np.ndarray]:
        return shape_gradients(self.mesh.nodes[self.mesh.quads])

    @cached_property
    def fibres(self) -> np.ndarray:
        """(n_quad, 4, n_family, 2) ndarray: unit vectors."""
        return fibre_directions(self.tissue, self.section, self.mesh)

    @cached_property
    def element_volume(self) -> np.ndarray:
        """(n_quad,) ndarray [mm^2]."""
        return self.shape_functions[1].sum(axis=1)

    @cached_property
    def skin_length(self) -> np.ndarray:
        """(n_skin,) ndarray [mm]: length of undeformed skin that each node stands for."""
        skin = self.mesh.nodes[self.mesh.skin_nodes]
        return tributary(skin)

    @property
    def lowest(self) -> float:
        """Height of the undeformed pad's lowest point [mm]: where the plate touches."""
        return float(self.mesh.nodes[self.mesh.skin_nodes, 1].min())

    def at_rest(self) -> State:
        """The undeformed finger, the plate touching without force."""
        skin = self.mesh.nodes[self.mesh.skin_nodes]
        return State(np.zeros_like(self.mesh.nodes), 1.0, self.lowest, 0.0, np.zeros(len(self.mesh.quads)),
                     ContactHistory.open(skin[:, 1] - self.lowest))

    # ---- numbering ------------------------------------------------------------------------------------------

    @property
    def n_unknowns(self) -> int:
        return 2 * len(self.mesh.nodes) + 2

    @property
    def stretch_row(self) -> int:
        return self.n_unknowns - 2

    @property
    def plate_row(self) -> int:
        return self.n_unknowns - 1

    @cached_property
    def element_rows(self) -> np.ndarray:
        """(n_quad, 9) ndarray of int: unknowns of each element."""
        corner = np.stack([2 * self.mesh.quads, 2 * self.mesh.quads + 1], axis=2).reshape(-1, 8)
        return np.column_stack([corner, np.full(len(corner), self.stretch_row)])

    @cached_property
    def held_rows(self) -> np.ndarray:
        """Unknowns that never move: the bone's."""
        held = np.concatenate([2 * self.mesh.bone_nodes, 2 * self.mesh.bone_nodes + 1])
        return np.append(held, self.stretch_row) if np.isinf(self.out_of_plane.stiffness) else held

    @cached_property
    def free_rows(self) -> np.ndarray:
        """Unknowns that move, the plate's height last."""
        return np.setdiff1d(np.arange(self.n_unknowns), self.held_rows)

    @cached_property
    def _pattern(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """CSR pattern of the free unknowns; where element and contact entries go, the last place for the rest."""
        skin = self.mesh.skin_nodes
        x, y, plate = 2 * skin, 2 * skin + 1, np.full(len(skin), self.plate_row)
        every = np.arange(self.n_unknowns)
        rows = np.concatenate([np.repeat(self.element_rows, 9, axis=1).ravel(), x, x, x, y, y, plate, plate, every])
        columns = np.concatenate([np.tile(self.element_rows, (1, 9)).ravel(), x, y, plate, y, plate, y, plate, every])
        number = np.full(self.n_unknowns, -1)
        number[self.free_rows] = np.arange(len(self.free_rows))
        rows, columns = number[rows], number[columns]
        kept = (rows >= 0) & (columns >= 0)
        key = rows[kept].astype(np.int64) * len(self.free_rows) + columns[kept]
        entries, place_of = np.unique(key, return_inverse=True)
        place = np.full(len(rows), len(entries), dtype=np.int64)
        place[kept] = place_of
        counts = np.bincount(entries // len(self.free_rows), minlength=len(self.free_rows))
        n_element = 81 * len(self.mesh.quads)
        return (np.concatenate([[0], np.cumsum(counts)]).astype(np.int32),
                (entries % len(self.free_rows)).astype(np.int32), place[:n_element], place[n_element:])

    @cached_property
    def solver(self) -> PatternedLU:
        """The linear solver, its symbolic work kept from step to step."""
        return PatternedLU(self._pattern[0], self._pattern[1])

    @cached_property
    def _room(self) -> dict[str, np.ndarray]:
        n = len(self.mesh.quads)
        return {"tangent": np.empty((n, 9, 9)), "force": np.empty((n, 9)), "dilatation_force": np.empty((n, 9)),
                "dilatation": np.empty(n), "energy": np.empty(n), "largest_fibre": np.empty(n)}

    # ---- the equations --------------------------------------------------------------------------------------

    def residual(self, trial: State, history: ContactHistory, normal_force: float | None, predict: bool = False,
                 drag: tuple[float, np.ndarray] | None = None) -> Residual:
        """The system at a trial state; element tangents stay ready for :meth:`tangent`.

        Parameters
        ----------
        trial : State
        history : ContactHistory
            Of the last converged state.
        normal_force : float [N/mm], optional
            On the plate; None where the plate's height is given.
        predict : bool
            See :func:`rom.finger_on_glass.contact.contact_response`.
        drag : (float [MPa/mm], (n_node, 2) ndarray [mm]), optional
            Viscous resistance of the skin against motion from these displacements.

        Returns
        -------
        Residual
        """
        room, skin = self._room, self.mesh.skin_nodes
        corner = trial.displacement[self.mesh.quads].reshape(-1, 8)
        tissue = self.tissue
        usable = element_response(
            *self.shape_functions, self.fibres, corner, trial.stretch_z, trial.pressure, tissue.c, tissue.k1, tissue.k2,
            room["tangent"], room["force"], room["dilatation_force"], room["dilatation"], room["energy"],
            room["largest_fibre"])
        position = self.mesh.nodes[skin] + trial.displacement[skin]
        contact = contact_response(self.plate, history, position[:, 1] - trial.plate_y,
                                   trial.displacement[skin, 0] - trial.plate_x, predict)
        outer = np.zeros(self.n_unknowns)
        if np.isfinite(self.out_of_plane.stiffness):
            outer[self.stretch_row] = self.out_of_plane.stiffness * (trial.stretch_z - 1)
        outer[2 * skin] = self.skin_length * contact.shear
        outer[2 * skin + 1] = -self.skin_length * contact.pressure
        if drag is not None:
            pull = drag[0] * self.skin_length[:, None] * (trial.displacement[skin] - drag[1][skin])
            outer[2 * skin] += pull[:, 0]
            outer[2 * skin + 1] += pull[:, 1]
        outer[self.plate_row] = self.skin_length @ contact.pressure - (normal_force or 0.0)
        own = room["force"] + trial.pressure[:, None] * room["dilatation_force"]
        condensed = room["force"] + (self.tissue.bulk * room["dilatation"])[:, None] * room["dilatation_force"]
        volume_error = float(np.abs(room["dilatation"] - trial.pressure / self.tissue.bulk).max())
        return Residual(usable, outer + self._gather(own), outer + self._gather(condensed), volume_error, contact,
                        room["dilatation"].copy(), room["dilatation_force"].copy(), float(room["energy"].sum()),
                        float(room["largest_fibre"].max()))

    def _gather(self, element_values: np.ndarray) -> np.ndarray:
        return np.bincount(self.element_rows.ravel(), element_values.ravel(), self.n_unknowns)

    def tangent(self, at: Residual, plate_held: bool, drag: float = 0.0) -> np.ndarray:
        """Values of the condensed tangent in the solver's pattern, right after :meth:`residual` of the same state.

        Parameters
        ----------
        at : Residual
        plate_held : bool
            The plate's height is given: its row is the identity.
        drag : float [MPa/mm]
        """
        indptr, indices, element_place, contact_place = self._pattern
        rank_one = (self.tissue.bulk / self.element_volume)[:, None, None] * (
            at.dilatation_force[:, :, None] * at.dilatation_force[:, None, :])
        w, contact = self.skin_length, at.contact
        diagonal = np.zeros(self.n_unknowns)
        if np.isfinite(self.out_of_plane.stiffness):
            diagonal[self.stretch_row] = self.out_of_plane.stiffness
        normal = w * contact.pressure_by_gap
        outer = np.concatenate([
            w * contact.shear_by_x + w * drag, w * contact.shear_by_gap, -w * contact.shear_by_gap,
            -normal + w * drag, normal, normal, -normal, diagonal])
        values = np.bincount(element_place, (self._room["tangent"] + rank_one).ravel(), len(indices) + 1)
        values += np.bincount(contact_place, outer, len(indices) + 1)
        if plate_held:
            last = slice(indptr[-2], indptr[-1])
            values[last] = indices[last] == len(indptr) - 2
        return values[:-1]

    def moved(self, state: State, step: np.ndarray, share: float, pressure_step: np.ndarray) -> State:
        """The trial state after a share of a Newton step."""
        return replace(state, displacement=state.displacement + share * step[:-2].reshape(-1, 2),
                       stretch_z=state.stretch_z + share * step[-2], plate_y=state.plate_y + share * step[-1],
                       pressure=state.pressure + share * pressure_step)


def tributary(line: np.ndarray) -> np.ndarray:
    """(n,) ndarray: half the length of the two pieces that meet at each point of a closed line.

    Parameters
    ----------
    line : (n, 2) ndarray
    """
    piece = np.linalg.norm(np.roll(line, -1, axis=0) - line, axis=1)
    return 0.5 * (piece + np.roll(piece, 1))
