"""Metamodels: every method under one protocol, by its canonical name."""

from rom.metamodels.facts import Curve, Needs
from rom.metamodels.metamodel import Metamodel
from rom.metamodels.registry import METHODS, applicable, create, load, metamodel_class, method_names, register
from rom.metamodels.stored import Stored
from rom.metamodels.validity import Assessment, ValidityWarning

__all__ = ["METHODS", "Assessment", "Curve", "Metamodel", "Needs", "Stored", "ValidityWarning", "applicable", "create",
           "load", "metamodel_class", "method_names", "register"]
