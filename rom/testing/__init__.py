"""The conformance suite: every promise of `Metamodel`, checked on any method, one's own included.

    from rom.testing import check_metamodel

    def test_my_method():
        check_metamodel(MyMethod(scene, rank=8), train)

An AssertionError says what is wrong, and a note to it which promise is broken.
"""

from __future__ import annotations

import tempfile
import warnings
from pathlib import Path

import xarray as xr

from rom.metamodels import Metamodel, ValidityWarning
from rom.scenes import Cases
from rom.testing.promises import PROMISES
from rom.testing.subject import Subject

__all__ = ["PROMISES", "check_metamodel"]


def check_metamodel(model: Metamodel, train: xr.Dataset | None = None, *, cases: Cases | None = None,
                    rounding: float | None = None) -> None:
    """Check every promise of `Metamodel` on a method.

    Parameters
    ----------
    model : Metamodel
        Says which class, scene and settings; it is neither fitted nor changed. Small ones keep this short: a method is
        fitted about six times.
    train : xr.Dataset, optional
        What a method that learns is given; default: 80 cases of its scene, solved here.
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
        subject = Subject(model, train, cases, rounding, Path(folder))
        for promise in PROMISES:
            try:
                promise(subject)
            except Exception as error:
                error.add_note(f"{model.name} breaks the promise: {promise.__doc__}")
                raise
