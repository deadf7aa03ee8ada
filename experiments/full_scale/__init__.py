"""What a few hundred held-out cases cannot show: errors over the whole published population, case by case."""

from full_scale.contenders import Contenders
from full_scale.study import full_scale

__all__ = ["Contenders", "full_scale"]
