"""Counts behind a plan: entries, bytes, floating-point operations, from the mesh and the methods' settings."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from rom.fullorder.factor_size import FactorSize, factor_size
from rom.metamodels.basis import PRECISIONS

if TYPE_CHECKING:
    from rom.bodies import Body, Grid, Outline
    from rom.metamodels.metamodel import Metamodel
    from rom.scenes import LinearScene

Counts = dict[str, float]
COMPLEX_FLOP = 4
"""Real operations of a complex multiply-add over those of a real one."""


def mesh(grid: Grid | None) -> Counts:
    """Nodes, elements, and bytes of coordinates and connectivity."""
    if grid is None:
        return {}
    held = [grid.nodes, *grid.cells.values(), *grid.region.values()]
    return {"nodes": grid.n_node, "elements": sum(map(len, grid.cells.values())), "bytes": sum(a.nbytes for a in held)}


@dataclass(frozen=True)
class Matrices:
    """Counts of one body's matrices and factors; computed when asked for."""

    body: Body

    @cached_property
    def _outline(self) -> Outline:
        return self.body.outline()

    def _sparse(self, entries: tuple[int, ...]) -> Counts:
        if not entries:
            return {}
        n = self._outline.pattern.shape[0]
        return {"dofs": n, "entries": entries[-1], "bytes": sum(12 * one + 4 * (n + 1) for one in entries)}

    @cached_property
    def stiffness(self) -> Counts:
        return self._sparse(self._outline.stiffness)

    @cached_property
    def mass(self) -> Counts:
        return self._sparse(self._outline.mass)

    @cached_property
    def _factor(self) -> FactorSize | None:
        return factor_size(self._outline.pattern)

    def factor(self, complex_: bool) -> Counts:
        """Entries, bytes and operations of one numeric factorization; empty without a symbolic phase."""
        if self._factor is None:
            return {}
        return {"entries": self._factor.entries, "bytes": (16 if complex_ else 8) * self._factor.entries,
                "flop": (COMPLEX_FLOP if complex_ else 1) * self._factor.flop}

    def solve_flop(self, complex_: bool) -> float:
        """Operations of one solve: each entry of the factor is used forwards and backwards."""
        return 0.0 if self._factor is None else 4.0 * (COMPLEX_FLOP if complex_ else 1) * self._factor.entries


def modes(model: Metamodel) -> Counts:
    """Number of modes, where the settings say it; the others are counted in the band when they are built."""
    count = model.settings.get("modes")
    return {} if count is None else {"modes": count}


def solves_per_load(model: Metamodel) -> int:
    """Static solves for each unit load: Lanczos takes one for its start and one for each vector."""
    vectors = getattr(model, "n_vectors", None)
    return 1 if vectors is None else 1 + vectors


def responses(scene: LinearScene, model: Metamodel) -> Counts:
    """Unit loads and right-hand sides."""
    return {"loads": scene.n_loads, "solves": scene.n_loads * solves_per_load(model)}


def answer_bytes(scene: LinearScene, outputs: str) -> int:
    """One case's answer in double precision."""
    return scene.n_outputs(outputs) * scene.dtype.itemsize


def online(scene: LinearScene, model: Metamodel, outputs: str, working: Matrices) -> Counts:
    """Bytes held and operations of one answer of one force, where the settings decide them."""
    moves, n_out = scene.harmonic, scene.n_outputs(outputs)
    if model.needs(scene).solves:
        factor, kept = working.factor(moves), getattr(model, "keeps_factor", False) and not moves
        return factor and {"bytes": factor["bytes"],
                           "flop": (0 if kept else factor["flop"]) + working.solve_flop(moves)}
    if getattr(model, "fields", None) is None:
        return {}
    held, read = model.fields  # type: ignore[attr-defined]
    stored = (scene.n_free + len(scene.part_rows)) * PRECISIONS[model.settings.get("precision", "float64")].itemsize
    return {"fields": held, "bytes": held * stored, "flop": 2.0 * (2 if moves else 1) * read * n_out}


WORDS = (("bytes", 1e9, "GB"), ("bytes", 1e6, "MB"), ("bytes", 1e3, "kB"), ("bytes", 1.0, "B"),
         ("flop", 1e9, "Gflop"), ("flop", 1e6, "Mflop"), ("flop", 1e3, "kflop"), ("flop", 1.0, "flop"))


def spoken(unit: str, value: float) -> str:
    """A count with its unit, large ones scaled."""
    for name, scale, word in WORDS:
        if name == unit and value >= scale:
            return f"{value / scale:.3g} {word}"
    return f"{value:,.0f} {unit}"
