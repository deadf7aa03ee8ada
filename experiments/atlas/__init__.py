"""The stability atlas: every method at stiff and extreme cases, and whether it says when it is in trouble."""

from atlas.extremes import AXES, levels
from atlas.judge import OUTCOMES
from atlas.survey import atlas

__all__ = ["AXES", "OUTCOMES", "atlas", "levels"]
