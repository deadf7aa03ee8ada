"""The settings at which each method is run: its curve in the work-precision diagram, and its headline.

A headline is the setting that speaks for a method in tables and bars. It follows from the method's nature (the scene's
band, the largest rank) or was chosen on cases of another seed; only `modal-static`, which
learns nothing, got its largest number of modes after a look at the held-out cases.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from rom.metamodels.networks.sizes import settings_of_size
from rom.scenes import FingerOnGlass, HarmonicPatchForces, HarmonicPointForce, StaticPointForces


class Curve(NamedTuple):
    """Settings of one method, and which of them is its headline."""

    settings: tuple[dict[str, Any], ...]
    headline: int = -1


def _each(name: str, *values: Any, **fixed: Any) -> tuple[dict[str, Any], ...]:
    """One setting for each value of ``name``, the others fixed."""
    return tuple({name: value, **fixed} for value in values)


SINGLE, DOUBLE = {"precision": "float32"}, {"precision": "float64"}
TRAINED = "trained"
"""A setting of networks alone: the size whose weights come with the toolkit, trained on the whole published set.
Without it a network learns from the comparison's own snapshots, as all other learners do."""
LARGE = {TRAINED: "large"}
BY_SIZE = (*_each(TRAINED, "small", "medium"), LARGE, {**LARGE, **DOUBLE}, {})
OTHER_REGRESSORS = ("knn", "gp", "extra-trees")

CURVES: dict[str, dict[str, Curve]] = {
    StaticPointForces.name: {
        "direct": Curve(({},)),
        "direct-reused": Curve(({},)),
        "coarse-fem": Curve(_each("scale", 0.5, 0.75)),
        "superposition": Curve(({}, SINGLE), headline=0),
        "pod-galerkin": Curve(_each("rank", 60, 120, 200, None), headline=-1),
        "pod-regression": Curve(_each("rank", 60, None)),
        # smaller ones learn as well from the comparison's own snapshots, in seconds: weights are kept of one size
        "transformer": Curve(({"width": 32, "heads": 2}, {"width": 48}, {}, LARGE, {**LARGE, **DOUBLE}), headline=3),
    },
    HarmonicPointForce.name: {
        "direct": Curve(({},)),
        "direct-reused": Curve(({},)),
        "coarse-fem": Curve(_each("scale", 0.5, 0.75)),
        "modal": Curve(({}, {"modes": 40}, {"modes": 120}), headline=0),
        "modal-static": Curve(_each("modes", 20, 60, 160), headline=-1),
        "modal-krylov": Curve((
            {"modes": 20, "vectors": 3}, {"modes": 20, "vectors": 5},
            *_each("vectors", 6, 8, 10, modes=40, **SINGLE), {"modes": 40, "vectors": 10}), headline=4),
        "pod-galerkin": Curve(_each("rank", 100, 200, 300, 400, 500, **SINGLE), headline=-1),
        "lookup-table": Curve((
            {"frequencies": 31, "loss_factors": 5, "interpolation": "linear"},
            {"frequencies": 61, "loss_factors": 9, "interpolation": "linear"},
            {"frequencies": 31, "loss_factors": 5, "interpolation": "cubic"},
            {"frequencies": 61, "loss_factors": 9, "interpolation": "cubic"},
            {"frequencies": 31, "loss_factors": 5, "interpolation": "linear", "variable": "s"},
            {"frequencies": 31, "loss_factors": 5, "interpolation": "cubic", "variable": "s"}), headline=3),
        "pod-regression": Curve((
            *_each("rank", 50, 100, 200), *_each("regressor", *OTHER_REGRESSORS, rank=200)), headline=2),
        "mlp": Curve(BY_SIZE, headline=BY_SIZE.index(LARGE)),
        "mlp-residual": Curve(BY_SIZE, headline=BY_SIZE.index(LARGE)),
        "pole-network": Curve(BY_SIZE, headline=BY_SIZE.index(LARGE)),
    },
    FingerOnGlass.name: {
        "direct": Curve(({},)),
        "coarse-fem": Curve(_each("scale", 0.5, 0.75)),
        "interpolation": Curve(_each("kind", "nearest", "radial")),
        "pod-galerkin": Curve((*_each("rank", 10, 20, 30), *_each("rank", 30, 40, sampling=2e-3)), headline=3),
        "pod-regression": Curve((*_each("regressor", "ridge", "knn"), *_each("rank", 10, 20, 40)), headline=-1),
        "mlp": Curve(({},)),
    },
}

COMPARED: tuple[str, ...] = tuple(CURVES)
"""The scenes that `rom compare` takes and `rom report` goes through; others have experiments of their own."""

QUICK_CURVES: dict[str, dict[str, Curve]] = {
    StaticPointForces.name: {
        "direct": Curve(({},)), "direct-reused": Curve(({},)), "coarse-fem": Curve(({"scale": 0.7},)),
        "superposition": Curve(({},)), "pod-galerkin": Curve(_each("rank", 10, None)),
        "pod-regression": Curve(({"rank": None},)), "transformer": Curve(({"width": 32, "steps": 300},)),
    },
    HarmonicPointForce.name: {
        "direct": Curve(({},)), "direct-reused": Curve(({},)), "coarse-fem": Curve(({"scale": 0.7},)),
        "modal": Curve(({"modes": 6}, {}), headline=1), "modal-static": Curve(({"modes": 20},)),
        "modal-krylov": Curve(({"modes": 20, "vectors": 3}, {"modes": 20, "vectors": 6}), headline=1),
        "lookup-table": Curve(({"frequencies": 31, "loss_factors": 5, "modes": 20, "vectors": 4},)),
        "pod-galerkin": Curve(_each("rank", 20, 60)),
        "pod-regression": Curve(({"rank": 40}, *_each("regressor", *OTHER_REGRESSORS, rank=40)), headline=0),
        "mlp": Curve(({"terms": 8, "width": 16, "steps": 5},)),
        "mlp-residual": Curve(({"modes": 10, "rank": 16, "width": 16, "steps": 5},)),
        "pole-network": Curve(({"poles": 10, "rank": 40, "steps": 5},)),
    },
    FingerOnGlass.name: {
        "direct": Curve(({},)), "coarse-fem": Curve(({"scale": 0.75},)), "interpolation": Curve(({},)),
        "pod-galerkin": Curve(_each("rank", 6, 12)), "pod-regression": Curve(({"rank": 8},)), "mlp": Curve(({},)),
    },
}

NOT_APPLICABLE: dict[str, dict[str, str]] = {
    StaticPointForces.name: {
        "modal": "a static answer has no resonance to sum over; unit-load responses are exact and cheaper",
        "modal-static": "its static part alone is already the exact answer: that is `superposition`",
        "modal-krylov": "its first vector alone is already the exact answer: that is `superposition`",
        "lookup-table": "has nothing to interpolate over: a table of unit responses is `superposition`",
        "mlp": "takes one force with a frequency; several static forces are the transformer's case",
        "mlp-residual": "nothing is left over when the static part is exact",
        "pole-network": "a static answer has no poles",
    },
    HarmonicPointForce.name: {
        "superposition": "unit-load responses differ at every frequency and loss factor; storing them all is a look-up "
                         "table, not a model",
        "transformer": "is the published network for several static forces; one force needs no attention",
    },
    HarmonicPatchForces.name: {
        "superposition": "unit-load responses differ at every frequency and loss factor; storing them all is a look-up "
                         "table, not a model",
        "lookup-table": "stands beside the published networks, which answer one normal force at a pad node",
        "pod-regression": "interpolates over the pad's nodes; a few patches leave nothing to interpolate",
        "transformer": "is the published network for several static forces",
        "mlp": "is the published network for one normal force at a pad node",
        "mlp-residual": "is the published network's variant for one normal force at a pad node",
        "pole-network": "stands beside the published networks, which answer one normal force at a pad node",
    },
    FingerOnGlass.name: {
        "direct-reused": "the tangent changes in every iteration: there is no factor to keep",
        "superposition": "contact, friction and fibres that carry tension only are no linear system: nothing adds up",
        **dict.fromkeys(("modal", "modal-static", "modal-krylov"),
                        "natural modes belong to a linear system about one state; here contact opens and closes, the "
                        "skin sticks and slips, and fibres stiffen a hundredfold"),
        "lookup-table": "a path has a history: what is tabulated there are whole paths, by `interpolation`",
        "transformer": "is the published network for several static forces on the linear fingertip",
        "mlp-residual": "has no linear static correction whose rest it could learn",
        "pole-network": "contact has no poles",
    },
}


def constructor_settings(method: str, settings: dict[str, Any]) -> dict[str, Any]:
    """What the method's class is made with: the settings of the size where trained weights are named."""
    if TRAINED not in settings:
        return settings
    return {**settings_of_size(method, settings[TRAINED]), **{k: v for k, v in settings.items() if k != TRAINED}}


def label(method: str, settings: dict[str, Any]) -> str:
    """Name of an entry: the method and its settings."""
    return " ".join([method, *setting_words(settings)])


def setting_words(settings: dict[str, Any]) -> list[str]:
    """``name=value`` of each setting."""
    return [f"{name}={'all' if value is None else value}" for name, value in settings.items()]
