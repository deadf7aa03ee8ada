"""Metamodels: every method under one protocol, by its canonical name."""

from rom.metamodels.metamodel import Metamodel
from rom.metamodels.registry import METHODS, applicable, create, load, metamodel_class

__all__ = ["METHODS", "Metamodel", "applicable", "create", "load", "metamodel_class"]
