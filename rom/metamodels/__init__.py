"""Metamodels: every method under one protocol, by its canonical name."""

from rom.metamodels.metamodel import Metamodel
from rom.metamodels.registry import METHODS, applicable, create, load, metamodel_class
from rom.metamodels.validity import Assessment, ValidityWarning

__all__ = ["METHODS", "Assessment", "Metamodel", "ValidityWarning", "applicable", "create", "load", "metamodel_class"]
