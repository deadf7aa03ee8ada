"""What a scene and a method build for their first answer, what they leave out and why, counted before it happens.

The plan is drawn up from the mesh and the pattern of its matrices alone: nothing is assembled, factorised or learnt.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

from rom.comparison import plan_counts as counts
from rom.comparison.settings import CURVES, NOT_APPLICABLE, constructor_settings
from rom.metamodels import METHODS, create, metamodel_class
from rom.metamodels.metamodel import Metamodel
from rom.scenes import HarmonicPatchForces, HarmonicPointForce, Scene, StaticPointForces

RECOMMENDED: dict[str, str] = {
    StaticPointForces.name: "superposition",
    HarmonicPointForce.name: "modal-krylov",
    HarmonicPatchForces.name: "modal-krylov"}
"""Exact where the scene is linear statics; where it vibrates, the method that bounds its own error."""


class _Uses(NamedTuple):
    """What a method asks of the full-order model in `fit` and in its first answer."""

    stiffness: bool = True
    solves: bool = False
    """Whether it solves the scene's own equation, real or complex as the scene is."""
    modes: bool = False
    responses: bool = False
    """Whether static responses of the unit loads are computed."""
    other_mesh: bool = False
    network: bool = False
    regression: bool = False


_NOTHING = _Uses(stiffness=False)
USES: dict[str, _Uses] = {
    "direct": _Uses(solves=True), "direct-reused": _Uses(solves=True),
    "coarse-fem": _Uses(solves=True, other_mesh=True),
    "superposition": _Uses(responses=True),
    "modal": _Uses(modes=True, responses=True), "modal-static": _Uses(modes=True, responses=True),
    "modal-krylov": _Uses(modes=True, responses=True), "lookup-table": _Uses(modes=True, responses=True),
    "pod-galerkin": _Uses(), "pod-regression": _NOTHING._replace(regression=True),
    "transformer": _NOTHING._replace(network=True), "mlp": _NOTHING._replace(network=True),
    "mlp-residual": _Uses(modes=True, responses=True, network=True),
    "pole-network": _Uses(responses=True, network=True)}


@dataclass(frozen=True)
class Step:
    """One thing that could be built.

    Parameters
    ----------
    name : str
    built : bool
        Whether fitting and the first answer need it.
    why : str
        What for, or why not.
    counts : dict
        Numbers by unit, such as ``{"entries": 1486386, "bytes": 17836632}``; empty where nothing can be counted.
    snapshots : bool
        Whether the training answers, made by direct solves before, need it.
    """

    name: str
    built: bool
    why: str
    counts: dict[str, float] = field(default_factory=dict)
    snapshots: bool = False


@dataclass(frozen=True)
class Plan:
    """The steps of one scene and method, in the order in which they happen."""

    scene: str
    method: str
    settings: dict[str, Any]
    outputs: str
    recommended: bool
    steps: tuple[Step, ...]

    def step(self, name: str) -> Step:
        """The step called ``name``; KeyError for another."""
        return {step.name: step for step in self.steps}[name]

    @property
    def built(self) -> list[Step]:
        return [step for step in self.steps if step.built]

    @property
    def skipped(self) -> list[Step]:
        return [step for step in self.steps if not step.built]


def plan(scene: Scene, method: str | None = None, outputs: str | None = None, **settings: Any) -> Plan:
    """The plan by which a method answers a scene's first case.

    Parameters
    ----------
    scene : Scene
    method : str, optional
        Default: :data:`RECOMMENDED`.
    outputs : {"field", "pad"}, optional
        Default: the scene's own.
    **settings
        Of the method; default: the headline of the comparison, where there is one.

    Raises
    ------
    ValueError
        For an unknown method, one that does not answer the scene, a setting that it does not take, or other outputs.
    """
    outputs = outputs or scene.outputs
    if outputs not in ("field", "pad"):
        raise ValueError(f"outputs={outputs!r} is unknown: a scene can want 'field' or 'pad'")
    chosen = method or RECOMMENDED[scene.name]
    if chosen in METHODS and scene.name not in metamodel_class(chosen).scenes:
        reason = NOT_APPLICABLE[scene.name].get(chosen, f"it answers {', '.join(metamodel_class(chosen).scenes)}")
        raise ValueError(f"{chosen} does not apply to {scene.name}: {reason}")
    if not settings and chosen in CURVES.get(scene.name, {}):
        curve = CURVES[scene.name][chosen]
        settings = constructor_settings(chosen, curve.settings[curve.headline])
    model = create(chosen, scene, **settings)
    return Plan(scene.name, chosen, model.settings, outputs, chosen == RECOMMENDED[scene.name],
                _steps(scene, model, outputs))


def _steps(scene: Scene, model: Metamodel, outputs: str) -> tuple[Step, ...]:
    uses, learns, moves = USES[model.name], model.learns, scene.harmonic
    without = scene.leaves_out.get
    none_needed = "the method learns from snapshots and never looks at the equations again"
    tip = scene.fingertip
    own = counts.matrices(tip)
    working = counts.matrices(model.other) if uses.other_mesh else own  # type: ignore[attr-defined]
    needs_real = uses.modes or uses.responses or (uses.solves and not moves)
    needs_complex = uses.solves and moves
    no_mass = without("mass matrix", "") if not moves else none_needed
    summed = "the answer is a sum of real fields with complex coefficients" if moves else ""
    return (
        Step("mesh", True, "everything stands on it", counts.mesh(tip.mesh), learns),
        Step("second mesh", uses.other_mesh, "the one that is solved on" if uses.other_mesh
             else "the scene's own mesh is enough", counts.mesh(model.other.mesh) if uses.other_mesh else {}),  # type: ignore[attr-defined]
        Step("stiffness by tissue", uses.stiffness,
             "K, real symmetric" + (", on the second mesh alone" if uses.other_mesh else "") if uses.stiffness
             else none_needed, working.stiffness, learns),
        Step("mass by tissue", uses.stiffness and moves, "M, real symmetric" if uses.stiffness and moves else no_mass,
             working.mass, learns and moves),
        Step("real factorization", needs_real, _why_real(uses, model) if needs_real else
             "the dynamic stiffness is complex" if needs_complex else
             "the projected system is small and dense" if uses.stiffness else none_needed,
             working.factor(complex_=False), learns and not moves),
        Step("complex factorization", needs_complex, "Z = K (1 + i eta) - omega^2 M, once for each point (omega, eta)"
             if needs_complex else summed or without("complex numbers", ""), working.factor(complex_=True),
             learns and moves),
        Step("modes", uses.modes, "proved complete by a Sturm count" if uses.modes else
             without("modes", "no step of this method needs them"), counts.modes(model) if uses.modes else {}),
        Step("static responses", uses.responses, "K^-1 times each unit load" + (
             ", and what follows from it" if uses.modes and counts.solves_per_load(model) > 1 else "")
             if uses.responses else "no stored response of a unit load is used",
             counts.responses(scene, model) if uses.responses else {}),
        Step("snapshots", learns, "direct solves to learn from: give `fit` a dataset" if learns
             else "the method looks at the full-order model alone"),
        Step("scikit-learn", uses.regression, "ridge regression" if uses.regression else "nothing is regressed"),
        Step("torch", uses.network, "the method is a network" if uses.network else
             without("torch", "the method is no network")),
        Step("complex answer", moves, "amplitude and phase" if moves else without("complex numbers", ""),
             {"bytes": counts.answer_bytes(scene, outputs)} if moves else {}),
        Step("full field online", *_full_field(scene, uses, outputs),
             {"dofs": scene.n_free, "bytes": scene.n_free * scene.dtype.itemsize}),
        Step("online model", True, "held and read for an answer", counts.online(scene, model, outputs, working)),
        Step("sensitivities", False, "no derivative is asked for, so no tissue's matrices are differentiated"),
        Step("figures", False, "an answer is numbers: matplotlib is imported where something is drawn"),
    )


def _why_real(uses: _Uses, model: Metamodel) -> str:
    if uses.modes:
        return "K for the search of modes, K - sigma M for the Sturm count"
    if uses.responses:
        return "K for the static responses"
    return "K, anew for each case" if model.name == "direct" else "K, once for all cases"


def _full_field(scene: Scene, uses: _Uses, outputs: str) -> tuple[bool, str]:
    if outputs == "field":
        return True, "the scene wants every node"
    if uses.solves and not uses.other_mesh:
        return True, "a sparse solve finds every node, of which the pad is then picked"
    return False, f"the pad's {3 * scene.n_pad:,} dofs alone are computed"


def explain(found: Plan) -> str:
    """The plan in words, a line a step."""
    width = max(len(step.name) for step in found.steps)
    settings = " ".join(f"{name}={value}" for name, value in found.settings.items() if value is not None)
    head = f"{found.scene} by {found.method}{', recommended' if found.recommended else ''}; outputs: {found.outputs}"
    lines = [head, *([f"settings: {settings}"] if settings else []), "", "built for the first answer"]
    for step in found.built:
        numbers = "; ".join(counts.spoken(unit, value) for unit, value in step.counts.items())
        lines.append(f"  {step.name:<{width}}  {step.why}{f' ({numbers})' if numbers else ''}")
    lines += ["", "left out"]
    for step in found.skipped:
        spared = "; ".join(counts.spoken(unit, value) for unit, value in step.counts.items())
        lines.append(f"  {step.name:<{width}}  {step.why}{f' (spares {spared})' if spared else ''}")
    before = [step.name for step in found.steps if step.snapshots]
    if before:
        lines += ["", f"before, for the snapshots: {', '.join(before)}"]
    lines += ["", "factors are counted by a symbolic analysis of the pattern; only the mesh was built to say all this"]
    return "\n".join(lines)


def observed_names() -> tuple[str, ...]:
    """Steps that stand for an event which can be watched, unlike those that only count."""
    return ("mesh", "second mesh", "stiffness by tissue", "mass by tissue", "real factorization",
            "complex factorization", "modes", "static responses", "snapshots", "scikit-learn", "torch",
            "complex answer", "full field online", "sensitivities", "figures")
