"""What varies in a scene and what it answers: names, units, ranges."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Input:
    """Something that varies from case to case.

    Parameters
    ----------
    name : str
        Of the variable in labelled cases.
    unit : str
        "1" for a pure number, empty for words.
    text : str
        What may be given, in words.
    long_name : str
    dims : tuple of str
        ``("case",)``, or ``("case", "force")`` where each force of a case has one.
    range : (float, float), optional
        Lowest and highest sampled value; outside is extrapolation.
    default : object, optional
        What stands for a variable that labelled cases leave out; None where it must be there.
    choices : tuple of str
        Words that may be given.
    """

    name: str
    unit: str
    text: str
    long_name: str = ""
    dims: tuple[str, ...] = ("case",)
    range: tuple[float, float] | None = None
    default: Any = None
    choices: tuple[str, ...] = ()

    @property
    def attributes(self) -> dict[str, str]:
        """Of the variable in labelled cases."""
        return {"long_name": self.long_name or self.text, **({"units": self.unit} if self.unit else {})}


@dataclass(frozen=True)
class Quantity:
    """Something that is answered, or said of an answer.

    Parameters
    ----------
    dims : tuple of str
        Beside ``case``.
    unit : str
        Empty for words.
    long_name : str
    """

    dims: tuple[str, ...]
    unit: str
    long_name: str

    @property
    def attributes(self) -> dict[str, str]:
        """Of the variable in datasets."""
        return {"long_name": self.long_name, **({"units": self.unit} if self.unit else {})}
