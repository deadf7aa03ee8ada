"""Errors in the energy norm and residuals, by their definitions: what bounds and answers are compared with."""

import numpy as np


def energy_errors(answers, truth, stiffness):
    """sqrt(e^H K e) of each case [J^1/2], e = answer - truth."""
    miss = (answers - truth).T
    return np.sqrt(sum(np.einsum("nc,nc->c", part, stiffness @ part) for part in (miss.real.copy(), miss.imag.copy())))


def relative_energy_errors(answers, truth, stiffness):
    """The same over sqrt(u^H K u)."""
    return energy_errors(answers, truth, stiffness) / energy_errors(truth, 0 * truth, stiffness)


def residuals(scene, cases, answer):
    """(n_case,) ndarray: ||Z u - f|| / ||f|| of labelled whole answers to labelled cases."""
    arrays, values = scene.read(cases), scene.values(answer)
    out = np.empty(len(arrays))
    for i in range(len(arrays)):
        one = arrays.take(slice(i, i + 1))
        out[i] = scene.model.residual(values[i][:, None], scene.force_vectors(one), *scene.point(one))[0]
    return out
