"""Linear second-order models on sparse matrices: direct solves, harmonic response, natural modes.

This floor knows matrices only, and no fingertip.
"""

from rom.fullorder.blas import blas_threads
from rom.fullorder.conditioning import IllConditionedWarning, condition_estimate
from rom.fullorder.dynamic_stiffness import DynamicStiffness
from rom.fullorder.factorization import Factorization, available_backends, factorize
from rom.fullorder.modes import Modes, modal_assurance_criterion, natural_modes, sturm_count
from rom.fullorder.pardiso import get_threads, set_threads, threads
from rom.fullorder.refinement import refined_solution
from rom.fullorder.second_order import SecondOrderModel
from rom.fullorder.symmetric import SymmetricMatrix

__all__ = [
    "DynamicStiffness",
    "Factorization",
    "IllConditionedWarning",
    "Modes",
    "SecondOrderModel",
    "SymmetricMatrix",
    "available_backends",
    "blas_threads",
    "condition_estimate",
    "factorize",
    "get_threads",
    "modal_assurance_criterion",
    "natural_modes",
    "refined_solution",
    "set_threads",
    "sturm_count",
    "threads",
]
