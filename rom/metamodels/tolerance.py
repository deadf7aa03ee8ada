"""Answers within a tolerance: cases that a method cannot show to meet it are answered by the next better one."""

from __future__ import annotations

import numpy as np

from rom.metamodels.metamodel import Metamodel
from rom.metamodels.validity import Assessment
from rom.scenes import CaseArrays


def answer_within(model: Metamodel, cases: CaseArrays, tolerance: float
                  ) -> tuple[np.ndarray, Assessment, np.ndarray, np.ndarray]:
    """Values, assessment, kind of each error, and who answered."""
    raise NotImplementedError
