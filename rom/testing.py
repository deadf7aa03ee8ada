"""The conformance suite: every promise of `Metamodel`, checked on any method, one's own included.

    from rom.testing import check_metamodel

    def test_my_method():
        check_metamodel(MyMethod(scene, rank=8), train)

An AssertionError says what is wrong, and a note to it which promise is broken.
"""

from __future__ import annotations

import copy
import re
import tempfile
import warnings
from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from rom.datasets import make_dataset, read_dataset
from rom.errors import NotFittedError, SchemaError
from rom.fullorder.energy_norm import energy_norms
from rom.metamodels import Curve, Metamodel, Needs, ValidityWarning
from rom.metamodels.networks.sizes import constructor_settings
from rom.metamodels.validity import KINDS
from rom.relative import relative_errors
from rom.scenes import Cases, LinearScene, Scene, get_scene, scene_from_json, scene_names

__all__ = ["PROMISES", "check_metamodel"]

TRAINING = 80
"""Cases that a method learns from where none are given."""
SINGLE, DOUBLE = 1e-4, 1e-9
"""What another order of the same operations may change of an answer's norm: a thousand units of single precision; in
double the unit roundoff times the condition of a stiffness, about 1e6. Iterations along load paths reach the first."""
REFERENCE = 1e-10
"""Relative energy error that a direct reference carries itself."""


def check_metamodel(model: Metamodel, train: xr.Dataset | None = None, *, cases: Cases | None = None,
                    rounding: float | None = None) -> None:
    """Check every promise of `Metamodel` on a method.

    Parameters
    ----------
    model : Metamodel
        Says which class, scene and settings; it is neither fitted nor changed. Small ones keep this short: a method is
        fitted about six times.
    train : xr.Dataset, optional
        What a method that learns is given; default: :data:`TRAINING` cases of its scene, solved here.
    cases : Cases, optional
        What is asked; default: a few within the scene's ranges, in linear scenes also beyond.
    rounding : float, optional
        What another order of the same operations may change, over an answer's norm; default: by the answers' precision.

    Raises
    ------
    AssertionError
        Where a promise is broken.
    """
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore", ValidityWarning)
        subject = _Subject(model, train, cases, rounding, Path(folder))
        for promise in PROMISES:
            try:
                promise(subject)
            except Exception as error:
                error.add_note(f"{model.name} breaks the promise: {promise.__doc__}")
                raise


class _Subject:
    """A method under examination, and what several promises ask of it."""

    def __init__(self, model: Metamodel, train: xr.Dataset | None, cases: Cases | None, rounding: float | None,
                 folder: Path) -> None:
        self.kind, self.scene, self.settings = type(model), model.scene, copy.deepcopy(model.settings)
        self.linear = isinstance(self.scene, LinearScene)
        self.folder, self._train, self._cases, self._rounding = folder, train, cases, rounding

    def fresh(self, **changed: Any) -> Metamodel:
        return self.kind(self.scene, **{**copy.deepcopy(self.settings), **changed})

    def fit(self, model: Metamodel, data: xr.Dataset | None = None) -> Metamodel:
        return model.fit((self.train if data is None else data) if self.kind.learns else None)

    @cached_property
    def train(self) -> xr.Dataset:
        if self._train is not None:
            return self._train
        return read_dataset(make_dataset(self.scene, TRAINING, self.folder / "training.nc"))

    @cached_property
    def fitted(self) -> Metamodel:
        return self.fit(self.fresh())

    @cached_property
    def cases(self) -> Any:
        if self._cases is not None:
            return self._cases
        if not self.linear:
            return self.scene.sample(3, 9)
        return self.scene.sample(4, 9).joined(self.scene.sample_beyond(2, 9))

    @cached_property
    def labelled(self) -> xr.Dataset:
        cases = self.scene.cases_from(self.cases)
        return cases.assign_coords(case=("case", 7 + np.arange(cases.sizes["case"])[::-1], cases["case"].attrs))

    @cached_property
    def answer(self) -> Any:
        return self.fitted.evaluate(self.cases)

    @cached_property
    def saved(self) -> Path:
        path = self.folder / f"saved{self.kind.suffix}"
        self.fitted.save(path)
        return path

    def close(self, found: Any, expected: Any, what: str, rounding: float | None = None) -> None:
        """Assert that answers agree to rounding: an array case by case, several quantities each by its largest."""
        if not isinstance(expected, dict):
            found, expected = {"answer": found}, {"answer": expected}
        _assert(list(found) == list(expected), f"{what}: quantities {list(found)} instead of {list(expected)}")
        for name, true in expected.items():
            mine = found[name]
            _assert(mine.shape == true.shape, f"{what}: {name} has shape {mine.shape} instead of {true.shape}")
            single = not self.linear or true.dtype.itemsize < np.result_type(true.dtype, np.float64).itemsize
            limit = (self._rounding or (SINGLE if single else DOUBLE)) if rounding is None else rounding
            if self.linear:
                error = relative_errors(mine, true).max()
            else:
                _assert(np.array_equal(np.isnan(mine), np.isnan(true)), f"{what}: {name} is NaN elsewhere")
                error = np.nanmax(np.abs(mine - true), initial=0.0) / np.nanmax(np.abs(true), initial=1e-300)
            _assert(error <= limit, f"{what}: {name} differs by {error:.1e}, above {limit:g}")


def _assert(condition: Any, message: str) -> None:
    if not condition:
        raise AssertionError(message)


def _refused(ask: Callable[[], Any], errors: Any, what: str) -> None:
    """Assert that ``ask()`` raises one of ``errors`` with one sentence."""
    try:
        ask()
    except errors as error:
        text = str(error)
        _assert(text.strip() and "\n" not in text, f"{what} is refused with {text!r}, not with one sentence")
        return
    raise AssertionError(f"{what} is not refused")


def _another(scene: Scene, **facts: Any) -> Scene:
    """The same scene but for some facts of it, such as its digest."""
    other = copy.copy(scene)
    kind = type("Another", (type(scene),), {
        name: property(lambda _, value=value: value) for name, value in facts.items()})
    object.__setattr__(other, "__class__", kind)
    return other


# ---- the promises -------------------------------------------------------------------------------------------

def states_its_facts(subject: _Subject) -> None:
    """The facts on the class are there, and `why_not` answers for every scene."""
    kind, scene = subject.kind, subject.scene
    for fact in ("name", "summary"):
        text = getattr(kind, fact, None)
        _assert(isinstance(text, str) and text.strip() and "\n" not in text, f"its {fact} is {text!r}")
    _assert(re.fullmatch("#[0-9a-fA-F]{6}", kind.colour), f"its colour is {kind.colour!r}, not such as #1f77b4")
    _assert(kind.why_not(scene) is None, f"it does not apply to its own scene: {kind.why_not(scene)}")
    _assert(isinstance(kind.needs(scene), Needs), "needs() gives no Needs")
    for curve in (kind.curve(scene), kind.quick_curve(scene)):
        _assert(isinstance(curve, Curve) and curve.settings, "a curve has no settings")
        _ = curve.settings[curve.headline]
        for settings in curve.settings:
            kind(scene, **constructor_settings(kind.name, settings))
    for name in scene_names():
        other = get_scene(name)
        reason = kind.why_not(other)
        _assert(reason is None or (reason.strip() and "\n" not in reason), f"why_not says {reason!r} of {name}")
        if reason is not None:
            _refused(lambda other=other: kind(other, **subject.settings), ValueError, f"the scene {name}")


def answers_nothing_before_a_fit(subject: _Subject) -> None:
    """Nothing is answered or saved before a fit."""
    model, path = subject.fresh(), subject.folder / f"fresh{subject.kind.suffix}"
    _assert(not model.fitted, "it calls itself fitted")
    for ask, what in ((lambda: model.predict(subject.labelled), "predict"), (lambda: model.save(path), "save"),
                      (lambda: model.evaluate(subject.cases), "evaluate")):
        _refused(ask, NotFittedError, f"{what} before a fit")
    _assert(not path.exists(), "it left a file")


def fits_and_refits(subject: _Subject) -> None:
    """`fit` returns the method itself, leaves its settings alone, and a second one forgets the first."""
    model = subject.fresh()
    half = subject.train.isel(case=slice(1, None, 2)) if subject.kind.learns and subject.linear else None
    for data in (half, None):
        _assert(subject.fit(model, data) is model, "fit() does not return the method")
        _assert(model.settings == subject.settings, f"fit() changed the settings to {model.settings}")
        _assert(model.fitted and model.offline_seconds > 0, "fit() leaves fitted or offline_seconds unset")
    subject.close(model.evaluate(subject.cases), subject.answer, "a second fit")
    _assert(not subject.kind.learns or model.trained is not None, "it does not know what it learned from")


def refuses_what_it_cannot_learn_from(subject: _Subject) -> None:
    """A method that learns refuses no data, data of another scene or mesh, and answers that are not finite."""
    if not subject.kind.learns:
        return
    model, train, judged = subject.fresh(), subject.train, subject.scene.quantity
    broken = train.isel(case=slice(0, max(2, train.sizes["case"] // 2))).copy(deep=True)
    broken[judged].values[1] = np.nan
    for data, error, what in ((None, ValueError, "a fit without data"), (broken, ValueError, "an answer of NaN"),
                              (train.assign_attrs(scene="another"), SchemaError, "training data of another scene"),
                              (train.assign_attrs(scene_hash="0" * 64), SchemaError, "training data of another mesh")):
        _refused(lambda data=data: model.fit(data), error, what)
    _assert(not model.fitted, "it calls itself fitted after refusing")


def predicts_purely(subject: _Subject) -> None:
    """`predict` says the same twice, leaves its cases alone, and gives answers that are the caller's own."""
    before = subject.labelled.copy(deep=True)
    found = subject.fitted.predict(subject.labelled)
    kept = found.copy(deep=True)
    found[subject.scene.quantity].values[:] = 0.0
    xr.testing.assert_identical(subject.fitted.predict(subject.labelled), kept)
    xr.testing.assert_identical(subject.labelled, before)


def labels_like_the_truth(subject: _Subject) -> None:
    """Answers have the full-order model's dimensions, names, units and coordinates, and nothing of a stored truth."""
    scene, cases = subject.scene, subject.labelled
    found = subject.fitted.predict(cases)
    expected = scene.label(cases, subject.answer)
    subject.close({name: found[name].values for name in scene.quantities if name in found}
                  if not subject.linear else found["displacement"].values.reshape(len(subject.cases), -1),
                  {name: expected[name].values for name in scene.quantities if name in expected}
                  if not subject.linear else expected["displacement"].values.reshape(len(subject.cases), -1),
                  "predict and evaluate")
    for name, quantity in scene.quantities.items():
        if name not in expected:
            continue
        _assert(found[name].dims == ("case", *quantity.dims), f"{name} has the dimensions {found[name].dims}")
        _assert(found[name].attrs.get("units") == quantity.unit, f"{name} has no units, or others")
        _assert(found[name].attrs.get("long_name") == quantity.long_name, f"{name} is called otherwise")
        _assert(np.iscomplexobj(found[name].values) == scene.harmonic, f"{name} has the type {found[name].dtype}")
    _assert(np.isfinite(found[scene.quantity].values).any(axis=None), "nothing is answered")
    for name in expected.coords:
        xr.testing.assert_identical(found[name].variable, expected[name].variable)
    for name in ("error_estimate", "error_kind", "validity"):
        _assert(found[name].dims == ("case",), f"{name} has the dimensions {found[name].dims}")
    _assert(found.attrs["method"] == subject.kind.name, f"the answer names the method {found.attrs.get('method')!r}")
    _assert(found.attrs["scene_hash"] == scene.content_hash, "the answer names another scene")
    if subject.kind.learns:
        answer = subject.fitted.predict(subject.train.isel(case=slice(0, 2)))
        kept = {*scene.record, "solve_seconds"} & set(answer.variables)
        _assert(not kept, f"the answer to stored cases carries {', '.join(sorted(kept))} of the truth")


def evaluates_a_batch_like_its_parts(subject: _Subject) -> None:
    """A batch is answered like its cases one by one, in any order, and the cases are left alone."""
    cases, count = subject.cases, len(subject.cases)
    before = copy.deepcopy(cases)
    parts = [subject.fitted.evaluate(cases.take(slice(i, i + 1))) for i in range(count)]
    for mine, theirs in zip(cases, before, strict=True):
        np.testing.assert_array_equal(mine, theirs)
    together = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]} \
        if isinstance(parts[0], dict) else np.concatenate(parts)
    subject.close(together, subject.answer, "case by case")
    order = np.random.default_rng(0).permutation(count)
    if subject.kind.slow == 1:  # whose batches are no mere loops
        order = np.tile(order, 150 // count + 1)
    chosen = {name: values[order] for name, values in subject.answer.items()} if isinstance(subject.answer, dict) \
        else subject.answer[order]
    subject.close(subject.fitted.evaluate(cases.take(order)), chosen, "in another order")


def gives_the_part_that_is_asked_for(subject: _Subject) -> None:
    """The scene's part is that part of the field, and `out` is filled where it fits and refused where not."""
    scene, model, cases = subject.scene, subject.fitted, subject.cases
    whole = model.evaluate(cases, "field")
    if not subject.linear:
        if scene.part:
            part = model.evaluate(cases, scene.part)
            subject.close(part, {name: whole[name] for name in part}, "the part")
        return
    for outputs in ("field", *([scene.part] if scene.part else [])):
        expected = whole if outputs == "field" else whole[:, scene.part_rows]
        subject.close(model.evaluate(cases, outputs), expected, f"outputs {outputs}")
        subject.close(model.evaluate(cases.take(slice(0, 1)), outputs), expected[:1], f"one case, outputs {outputs}")
        given = np.full_like(model.evaluate(cases, outputs), np.nan)
        _assert(model.evaluate(cases, outputs, given) is given, "`out` is not what comes back")
        subject.close(given, expected, "`out`")
    _refused(lambda: model.evaluate(cases, "field", np.empty((len(cases), 1), dtype=whole.dtype)), ValueError,
             "`out` of another shape")


def is_linear_where_the_scene_is(subject: _Subject) -> None:
    """In a linear scene amplitudes multiply, forces add, and room for further forces changes nothing."""
    if not subject.linear:
        return
    cases, model, kind = subject.cases, subject.fitted, type(subject.cases)
    point = (cases.frequency, cases.loss_factor)
    subject.close(model.evaluate(kind(cases.node, -2.5 * cases.force, *point)), -2.5 * subject.answer, "-2.5 forces")
    wide = kind(*(np.pad(array, ((0, 0), (0, 2))) for array in (cases.node, cases.force)), *point)
    subject.close(model.evaluate(wide), subject.answer, "room for two more forces")
    rng, n = np.random.default_rng(1), min(5, subject.scene.n_loads)
    node = np.stack([rng.permutation(subject.scene.n_loads)[:n] for _ in cases.node])
    force = rng.uniform(0.1, 1.0, node.shape)
    alone = [model.evaluate(kind(node[:, [j]], force[:, [j]], *point)) for j in range(n)]
    subject.close(model.evaluate(kind(node, force, *point)), sum(alone), f"{n} forces at once")


def judges_itself_honestly(subject: _Subject) -> None:
    """`assess` gives an error and a reason for each case, and what it calls a bound is one."""
    model, cases, scene = subject.fitted, subject.cases, subject.scene
    whole = model.evaluate(cases, "field")
    found = model.assess(cases)
    _assert(found.kind in KINDS, f"assess() calls its error {found.kind!r}")
    _assert(found.error.shape == found.reason.shape == (len(cases),), "assess() does not judge each case")
    _assert((found.error >= 0).all(), "assess() gives a negative error")
    if found.kind == "bound" and subject.linear:
        truth = scene.solve(cases)[0][scene.quantity]
        miss = energy_norms((whole - truth).T, scene.model.stiffness)
        made = miss / energy_norms(truth.T, scene.model.stiffness)
        _assert((made <= found.error + REFERENCE).all(), f"errors {made} lie above their bounds {found.error}")
    values = whole[scene.quantity] if isinstance(whole, dict) else whole
    best = model.best_approximation(cases, values)
    _assert(best is None or best.shape == values.shape, "best_approximation() has another shape than the answers")


def saves_and_loads(subject: _Subject) -> None:
    """What is saved has a size, and is loaded with the same settings, ranges and answers, and its own scene."""
    model, cases = subject.fitted, subject.cases
    again = subject.kind.load(subject.saved, subject.scene)
    _assert(type(again) is subject.kind and again.settings == model.settings, "the loaded method is another")
    _assert(np.isclose(again.offline_seconds, model.offline_seconds), "the loaded method cost another time")
    _assert(again.trained == model.trained, "the loaded method learned from another range")
    subject.close(again.evaluate(cases), subject.answer, "the loaded method")
    _assert(model.model_bytes > 0 and model.online_bytes >= 0, "model_bytes or online_bytes cannot be")
    for name, values in model.indicators(cases).items():
        np.testing.assert_array_equal(again.indicators(cases)[name][1], values[1])
    try:
        scene_from_json(subject.scene.to_json())
    except ValueError:  # a body that only its maker has
        _refused(lambda: subject.kind.load(subject.saved), SchemaError, "a file whose scene nobody can make")
        return
    alone = subject.kind.load(subject.saved).scene
    _assert(alone is not subject.scene and alone.content_hash == subject.scene.content_hash, "its scene is another")


def refuses_wrong_files(subject: _Subject) -> None:
    """Files that are cut, foreign, of another scene or mesh, or lack an array are refused by name."""
    kind, scene, saved = subject.kind, subject.scene, subject.saved
    wrong = subject.folder / f"wrong{kind.suffix}"
    content = saved.read_bytes()
    for damaged in (b"", content[:len(content) // 3], content[:-len(content) // 30], b"four words of nonsense\n"):
        wrong.write_bytes(damaged)
        _refused(lambda: kind.load(wrong, scene), SchemaError, f"a file of {len(damaged)} byte")
    _refused(lambda: kind.load(subject.folder / "absent", scene), SchemaError, "a file that is not there")
    for facts in ({"name": "another"}, {"content_hash": "0" * 64}):
        _refused(lambda facts=facts: kind.load(saved, _another(scene, **facts)), SchemaError, f"a scene with {facts}")
    if kind.suffix == ".nc":
        with xr.open_dataset(saved) as data:
            names = sorted(map(str, data.data_vars))
            data.drop_vars(names[:1]).to_netcdf(wrong)
        if names:
            _refused(lambda: kind.load(wrong, scene), SchemaError, f"a file without {names[0]}")


def follows_its_seed(subject: _Subject) -> None:
    """The same seed gives the same answers to the bit, another seed other weights."""
    if not subject.kind.seeded:
        return
    again = subject.fit(subject.fresh())
    subject.close(again.evaluate(subject.cases), subject.answer, "the same seed", 0.0)
    other = subject.fit(subject.fresh(seed=subject.settings.get("seed", 0) + 1))
    path = subject.folder / f"other{subject.kind.suffix}"
    other.save(path)
    mine, theirs = (subject.kind._read(one) for one in (subject.saved, path))
    # weights, not answers: an output layer in closed form may leave nothing to chance
    _assert(any(not np.array_equal(mine[name], theirs[name]) for name in mine.data_vars if name in theirs
                and mine[name].shape == theirs[name].shape) or set(mine) != set(theirs), "another seed changes nothing")


def refuses_wrong_cases(subject: _Subject) -> None:
    """Cases that are none, lack an input or hold NaN are refused in one sentence, and so is an unknown setting."""
    cases, model = subject.labelled, subject.fitted
    inputs = [one for one in subject.scene.inputs if one.name in cases and one.default is None]
    wrong: list[tuple[Any, str]] = [(None, "None for cases"), (xr.Dataset(), "an empty dataset"),
                                    (cases.isel(case=slice(0)), "a batch of no case")]
    for one in inputs:
        wrong.append((cases.drop_vars(one.name), f"a batch without {one.name}"))
        if cases[one.name].dtype.kind == "f":
            spoiled = cases.copy(deep=True)
            spoiled[one.name].values.flat[0] = np.nan
            wrong.append((spoiled, f"a {one.name} of NaN"))
    for data, what in wrong:
        _refused(lambda data=data: model.predict(data), ValueError, what)
    _refused(lambda: subject.fresh(colour_of_the_sky="blue"), (TypeError, ValueError), "a setting that there is not")


PROMISES: tuple[Callable[[_Subject], None], ...] = (
    states_its_facts, answers_nothing_before_a_fit, fits_and_refits, refuses_what_it_cannot_learn_from, predicts_purely,
    labels_like_the_truth, evaluates_a_batch_like_its_parts, gives_the_part_that_is_asked_for,
    is_linear_where_the_scene_is, judges_itself_honestly, saves_and_loads, refuses_wrong_files, follows_its_seed,
    refuses_wrong_cases)
"""What is checked, each a function of a method under examination."""
