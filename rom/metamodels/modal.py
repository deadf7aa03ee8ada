"""Modal superposition with hysteretic damping, and what must be added to it for loads at a point.

With K* = K (1 + i eta) and mass-orthonormal modes, u = sum phi_k (phi_k^T f) / (lambda_k (1 + i eta) - omega^2):
`modal` truncates that sum, `modal-static` adds the residual flexibility (what the left-out modes answer at 0 Hz),
`modal-krylov` adds further load-dependent vectors of each load (:mod:`rom.fullorder.load_vectors`).

All three have a certificate (:mod:`rom.metamodels.modal_bound`): a proven bound at the price of a few operations a
case.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import ClassVar

from rom.metamodels.facts import Curve
from rom.metamodels.linear import within
from rom.metamodels.modal_method import ModalMethod
from rom.metamodels.stored import Stored
from rom.scenes import LinearScene, Scene


class Modal(ModalMethod):
    """Plain modal superposition. Settings: see `ModalMethod`."""

    name: ClassVar[str] = "modal"
    summary: ClassVar[str] = "sums the natural modes within a band, nothing else"
    colour: ClassVar[str] = "#CC6677"
    static_reason: ClassVar[str] = ("a static answer has no resonance to sum over; unit-load responses are exact and "
                                    "cheaper")

    @classmethod
    def curve(cls, scene: Scene) -> Curve:
        return Curve(({}, *({"modes": within(scene, count)} for count in (40, 120))), headline=0)

    @classmethod
    def quick_curve(cls, scene: Scene) -> Curve:
        return Curve(({"modes": within(scene, 6)}, {}))


class ModalStatic(ModalMethod):
    """Modes plus residual flexibility: the left-out modes answer as they would at 0 Hz. Settings: see `ModalMethod`."""

    name: ClassVar[str] = "modal-static"
    summary: ClassVar[str] = "modes plus residual flexibility: each load's own static response of the left-out modes"
    colour: ClassVar[str] = "#882255"
    static_reason: ClassVar[str] = "its static part alone is already the exact answer: that is `superposition`"
    stored: ClassVar[tuple[Stored, ...]] = ModalMethod.with_vectors
    galerkin: ClassVar[bool] = False
    n_vectors = 1

    @classmethod
    def curve(cls, scene: Scene) -> Curve:
        return Curve(tuple({"modes": within(scene, count)} for count in (20, 60, 160)))

    @classmethod
    def quick_curve(cls, scene: Scene) -> Curve:
        return Curve(({"modes": within(scene, 20)},))


class ModalKrylov(ModalMethod):
    """Modes plus a few load-dependent vectors of each load, Galerkin on both.

    Parameters
    ----------
    vectors : int
        Of each load.
    modes, precision, loads
        See `ModalMethod`.
    """

    name: ClassVar[str] = "modal-krylov"
    summary: ClassVar[str] = "modes plus a few load-dependent (Krylov) vectors of each load, with an error certificate"
    colour: ClassVar[str] = "#332288"
    static_reason: ClassVar[str] = "its first vector alone is already the exact answer: that is `superposition`"
    stored: ClassVar[tuple[Stored, ...]] = ModalMethod.with_vectors

    def __init__(self, scene: LinearScene, modes: int | None = 40, vectors: int = 6, precision: str = "float64",
                 loads: Iterable[int] | None = None) -> None:
        if vectors < 1:
            raise ValueError(f"vectors={vectors} is too few: give one or more, or use the method `modal`")
        super().__init__(scene, modes, precision, loads)
        self.settings["vectors"] = vectors

    @property
    def n_vectors(self) -> int:
        return self.settings["vectors"]

    @classmethod
    def curve(cls, scene: Scene) -> Curve:
        few, many = within(scene, 20), within(scene, 40)
        single = {"modes": many, "precision": "float32"}
        return Curve(({"modes": few, "vectors": 3}, {"modes": few, "vectors": 5},
                      *({"vectors": vectors, **single} for vectors in (6, 8, 10)), {"modes": many, "vectors": 10}),
                     headline=4)

    @classmethod
    def quick_curve(cls, scene: Scene) -> Curve:
        few = within(scene, 20)
        return Curve(({"modes": few, "vectors": 3}, {"modes": few, "vectors": 6}))
