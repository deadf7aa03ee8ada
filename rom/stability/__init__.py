"""The stability atlas: every method at stiff and extreme cases, and whether it says when it is in trouble."""

from rom.stability.extremes import AXES, levels
from rom.stability.judge import OUTCOMES
from rom.stability.survey import atlas

__all__ = ["AXES", "OUTCOMES", "atlas", "levels"]
