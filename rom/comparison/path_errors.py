"""How wrong an answer to a load path is: displacements, and apart from them what the contact tells."""

from __future__ import annotations

import numpy as np

QUANTITIES = ("tangential force", "contact area", "pressure", "approach")
DEFINITIONS = {
    "tangential force": "difference over the normal force",
    "contact area": "difference over the true area",
    "pressure": "length of the difference over the length of the true profile, over the nodes of the skin",
    "approach": "difference of the plate's normal displacement over the true one"}


def displacement_errors(answer: np.ndarray, truth: np.ndarray, reached: np.ndarray) -> np.ndarray:
    """``||u_hat - u|| / ||u||`` of each state over all nodes.

    Parameters
    ----------
    answer, truth : (n_path, n_position, n_node, 2) ndarray [m]
    reached : (n_path, n_position) ndarray of bool
        Whether the truth is there.

    Returns
    -------
    (n_path, n_position) ndarray
        Infinite where the method has no answer, NaN where there is no truth.
    """
    flat = (*truth.shape[:2], -1)
    return _relative((answer - truth).reshape(flat), truth.reshape(flat), reached)


def contact_errors(answers: dict[str, np.ndarray], truth: dict[str, np.ndarray], normal_force: np.ndarray
                   ) -> np.ndarray:
    """Errors of the :data:`QUANTITIES`, as :data:`DEFINITIONS` say.

    Parameters
    ----------
    answers, truth : dict of (n_path, n_position, ...) ndarray
        By the names of :data:`rom.datasets.contact_schema.QUANTITIES`; truth with ``reached`` too.
    normal_force : (n_path,) ndarray [N]
        Held while the plate slides.

    Returns
    -------
    (n_path, n_position, 4) ndarray
        Infinite where the method has no answer, NaN where there is no truth.
    """
    def miss(name: str) -> np.ndarray:
        difference = answers[name] - truth[name]
        return difference.reshape(*difference.shape[:2], -1)

    reached = truth["reached"].astype(bool)
    size = np.broadcast_to(normal_force[:, None, None], (*reached.shape, 1))
    return np.stack([
        _relative(miss("tangential_force"), size, reached),
        _relative(miss("contact_area"), truth["contact_area"][..., None], reached),
        _relative(miss("pressure"), truth["pressure"], reached),
        _relative(miss("normal_displacement"), truth["normal_displacement"][..., None], reached)], axis=-1)


def _relative(miss: np.ndarray, truth: np.ndarray, reached: np.ndarray) -> np.ndarray:
    size, missed = np.linalg.norm(truth, axis=-1), np.linalg.norm(miss, axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        error = np.where(missed == 0.0, 0.0, missed / size)
    return np.where(reached, np.where(np.isfinite(error), error, np.inf), np.nan)
