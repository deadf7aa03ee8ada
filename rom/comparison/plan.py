"""What a scene and a method build for their first answer, what they leave out and why, counted before it happens.

The plan is drawn up from what methods and scenes say of themselves and, in linear scenes, from the pattern of the
matrices: nothing is assembled that is not there, nothing factorised or learnt.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from rom.comparison import plan_counts as counts
from rom.metamodels import Metamodel, Needs, create, metamodel_class
from rom.metamodels.networks.sizes import constructor_settings
from rom.scenes import LinearScene, Scene


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
        Default: the scene's :attr:`~rom.scenes.Scene.recommended` one.
    outputs : str, optional
        "field" or the scene's part; default: the scene's own.
    **settings
        Of the method; default: the headline of the comparison.

    Raises
    ------
    ValueError
        For an unknown method, one that does not answer the scene, a setting that it does not take, or other outputs.
    """
    outputs = scene.check_outputs(scene.outputs if outputs is None else outputs)
    chosen = method or scene.recommended
    kind = metamodel_class(chosen, scene)
    if not settings:
        curve = kind.curve(scene)
        settings = constructor_settings(chosen, curve.settings[curve.headline])
    model = create(chosen, scene, **settings)
    steps = _linear_steps(scene, model, outputs) if isinstance(scene, LinearScene) else _other_steps(scene, kind)
    return Plan(scene.name, chosen, model.settings, outputs, chosen == scene.recommended, steps)


def _linear_steps(scene: LinearScene, model: Metamodel, outputs: str) -> tuple[Step, ...]:
    needs, learns, moves = model.needs(scene), model.learns, scene.harmonic
    without = scene.leaves_out.get
    none_needed = "the method learns from snapshots and never looks at the equations again"
    own = counts.Matrices(scene.body)
    other = model.other.body if needs.other_mesh else None  # type: ignore[attr-defined]
    working = own if other is None else counts.Matrices(other)
    needs_real = needs.modes or needs.responses or (needs.solves and not moves)
    needs_complex = needs.solves and moves
    no_mass = without("mass matrix", "nothing moves") if not moves else none_needed
    summed = "the answer is a sum of real fields with complex coefficients" if moves else ""
    return (
        Step("mesh", scene.grid is not None, "everything stands on it" if scene.grid is not None
             else "the body came as matrices", counts.mesh(scene.grid), learns and scene.grid is not None),
        Step("second mesh", needs.other_mesh, "the one that is solved on" if needs.other_mesh
             else "the scene's own mesh is enough", counts.mesh(other.grid) if other is not None else {}),
        Step("stiffness", needs.stiffness,
             "K, real symmetric" + (", on the second mesh alone" if needs.other_mesh else "") if needs.stiffness
             else none_needed, working.stiffness, learns),
        Step("mass", needs.stiffness and moves, "M, real symmetric" if needs.stiffness and moves else no_mass,
             working.mass, learns and moves),
        Step("real factorization", needs_real, _why_real(needs, model) if needs_real else
             "the dynamic stiffness is complex" if needs_complex else
             "the projected system is small and dense" if needs.stiffness else none_needed,
             working.factor(complex_=False), learns and not moves),
        Step("complex factorization", needs_complex, "Z = K (1 + i eta) - omega^2 M, once for each point (omega, eta)"
             if needs_complex else summed or without("complex numbers", "nothing moves"), working.factor(complex_=True),
             learns and moves),
        Step("modes", needs.modes, "proved complete by a Sturm count" if needs.modes else
             without("modes", "no step of this method needs them"), counts.modes(model) if needs.modes else {}),
        Step("static responses", needs.responses, "K^-1 times each unit load" + (
             ", and what follows from it" if needs.modes and counts.solves_per_load(model) > 1 else "")
             if needs.responses else "no stored response of a unit load is used",
             counts.responses(scene, model) if needs.responses else {}),
        *_learning_steps(scene, type(model)),
        Step("complex answer", moves, "amplitude and phase" if moves else without("complex numbers", "nothing moves"),
             {"bytes": counts.answer_bytes(scene, outputs)} if moves else {}),
        Step("full field online", *_full_field(scene, needs, outputs),
             {"dofs": scene.n_free, "bytes": scene.n_free * scene.dtype.itemsize}),
        Step("online model", True, "held and read for an answer", counts.online(scene, model, outputs, working)),
        Step("sensitivities", False, "no derivative is asked for, so no region's matrices are differentiated"),
        Step("figures", False, "an answer is numbers: matplotlib is imported where something is drawn"),
    )


def _learning_steps(scene: Scene, kind: type[Metamodel]) -> tuple[Step, ...]:
    needs = kind.needs(scene)
    return (
        Step("snapshots", kind.learns, "full-order solves to learn from: give `fit` a dataset" if kind.learns
             else "the method looks at the full-order model alone"),
        Step("scikit-learn", needs.regression, "regression" if needs.regression else "nothing is regressed"),
        Step("torch", needs.network, "the method is a network" if needs.network else
             scene.leaves_out.get("torch", "the method is no network")))


def _other_steps(scene: Scene, kind: type[Metamodel]) -> tuple[Step, ...]:
    """What a scene says that it needs and leaves out."""
    needs = kind.needs(scene)
    how = "" if needs.solves else "in reduced coordinates: " if needs.stiffness else "for the snapshots alone: "
    return (*(Step(name, needs.solves or needs.stiffness, how + why, snapshots=kind.learns)
              for name, why in scene.needs.items()),
            *_learning_steps(scene, kind),
            *(Step(name, False, why) for name, why in scene.leaves_out.items() if name != "torch"))


def _why_real(needs: Needs, model: Metamodel) -> str:
    if needs.modes:
        return "K for the search of modes, K - sigma M for the Sturm count"
    if needs.responses:
        return "K for the static responses"
    return "K, anew for each case" if model.name == "direct" else "K, once for all cases"


def _full_field(scene: LinearScene, needs: Needs, outputs: str) -> tuple[bool, str]:
    if outputs == "field":
        return True, "the scene wants every node"
    if needs.solves and not needs.other_mesh:
        return True, "a sparse solve finds every node, of which the part is then picked"
    return False, f"the part's {len(scene.part_rows):,} dofs alone are computed"


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
    if any(step.counts for step in found.steps):
        lines += ["", "factors are counted by a symbolic analysis of the pattern; to say all this, mesh and unit loads "
                      "alone were built"]
    return "\n".join(lines)
