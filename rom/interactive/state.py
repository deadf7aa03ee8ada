"""What the page shows, as one frozen value: forces, frequency, loss factor, method, quantity, cut.

It travels in the address (query string) and in messages (JSON); both ways in end in one check.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any
from urllib.parse import parse_qsl, urlencode

import numpy as np

from rom.checks import choice, real_number, shown, whole_number
from rom.fingertip import Fingertip
from rom.fingertip.mesh import MILLIMETRE
from rom.metamodels import method_names

QUANTITIES = ("magnitude", "x", "y", "z", "normal", "phase", "strain")
MOST_FORCES = 3
AMPLITUDE = (1e-6, 10.0)
"""Smallest and largest magnitude of a force [N]; either sign, positive pushes into the skin."""
FREQUENCY = (0.0, 300.0)
LOSS_FACTOR = (0.0, 1.0)
DEFAULT_AMPLITUDE, DEFAULT_LOSS_FACTOR = 0.1, 0.1
DEFAULT_METHOD, DEFAULT_QUANTITY = "modal-krylov", "magnitude"
AXES = ("x", "y", "z")
PAGE_KEYS = ("view", "scale", "side", "click", "selected")
"""Keys of an address that are the page's own; their text is looked at no further than its letters."""
_KEYS = {"forces": "forces", "f": "frequency", "eta": "loss_factor", "method": "method", "quantity": "quantity",
         "cut": "cut", "probe": "probe"}
_PAGE_TEXT = re.compile(r"[\w.,:;+*/-]{0,200}", re.ASCII)
_NUMBER = re.compile(r"[+-]?(\d{1,30}\.?\d{0,30}|\.\d{1,30})([eE][+-]?\d{1,4})?", re.ASCII)
_NODE = re.compile(r"\d{1,9}", re.ASCII)


@dataclass(frozen=True)
class Limits:
    """What a state may hold on one fingertip.

    Parameters
    ----------
    pad_nodes : frozenset of int
        Nodes that carry forces.
    surface_nodes : frozenset of int
        Nodes that a probe may stand on.
    pad_center : int
        Where the default force stands.
    extent : dict of str to (float, float)
        Extent of the tissue along each axis [mm].
    """

    pad_nodes: frozenset[int]
    surface_nodes: frozenset[int]
    pad_center: int
    extent: Mapping[str, tuple[float, float]]

    @classmethod
    def of(cls, tip: Fingertip, surface_nodes: Iterable[int]) -> Limits:
        """The limits of a fingertip whose picture shows ``surface_nodes``."""
        mesh = tip.mesh
        low, high = mesh.nodes.min(axis=0) / MILLIMETRE, mesh.nodes.max(axis=0) / MILLIMETRE
        pad = mesh.nodes[mesh.pad_nodes]
        centre = mesh.nodes[mesh.fingerprint_centroid]
        nearest = int(mesh.pad_nodes[np.argmin(np.linalg.norm(pad - centre, axis=1))])
        return cls(frozenset(mesh.pad_nodes.tolist()), frozenset(int(node) for node in surface_nodes), nearest,
                   {axis: (float(low[i]), float(high[i])) for i, axis in enumerate(AXES)})


@dataclass(frozen=True)
class State:
    """One view of the fingertip; made by :func:`from_json` and :func:`from_query`, which check it.

    Parameters
    ----------
    forces : tuple of (int, float)
        Pad node and amplitude along the inward normal [N], one to three, each node once.
    frequency : float [Hz]
        0 is static.
    loss_factor : float
        Of no meaning at 0 Hz.
    method, quantity : str
    cut : (str, float), optional
        Axis and position [mm] of a plane.
    probe : int, optional
        A node of the surface to read beside the loaded ones.
    """

    forces: tuple[tuple[int, float], ...]
    frequency: float = 0.0
    loss_factor: float = DEFAULT_LOSS_FACTOR
    method: str = DEFAULT_METHOD
    quantity: str = DEFAULT_QUANTITY
    cut: tuple[str, float] | None = None
    probe: int | None = None

    @property
    def harmonic(self) -> bool:
        """Whether anything moves."""
        return self.frequency > 0.0

    def to_json(self) -> dict[str, Any]:
        """JSON-able; the inverse of :func:`from_json`."""
        return asdict(self)

    def to_query(self) -> str:
        """Query string without the question mark; the inverse of :func:`from_query`, to the last bit."""
        words = {"forces": ",".join(f"{node}:{amplitude!r}" for node, amplitude in self.forces),
                 "f": repr(self.frequency), "eta": repr(self.loss_factor), "method": self.method,
                 "quantity": self.quantity, "cut": "none" if self.cut is None else f"{self.cut[0]}:{self.cut[1]!r}"}
        if self.probe is not None:
            words["probe"] = str(self.probe)
        return urlencode(words, safe=":,")


MEMBERS = tuple(one.name for one in fields(State))


def from_json(record: Any, limits: Limits) -> State:
    """A state from a message.

    Parameters
    ----------
    record : dict
        As :meth:`State.to_json` writes it; what is missing is the default.
    limits : Limits

    Raises
    ------
    ValueError
        One sentence with the value, the rule and the remedy.
    """
    if not isinstance(record, dict):
        raise ValueError("the state is no JSON object: send forces, frequency, loss_factor, method, quantity, cut")
    for name in record:
        if name not in MEMBERS:
            raise ValueError(f"the state holds {shown(name)}, which it does not know: give {', '.join(MEMBERS)}")
    forces = record.get("forces", [[limits.pad_center, DEFAULT_AMPLITUDE]])
    if not isinstance(forces, (list, tuple)) or not 1 <= len(forces) <= MOST_FORCES:
        raise ValueError(f"the forces are {shown(forces)}: give one to {MOST_FORCES} pairs of a pad node and newtons")
    found = tuple(_force(one, limits) for one in forces)
    nodes = [node for node, _ in found]
    for node in set(nodes):
        if nodes.count(node) > 1:
            raise ValueError(f"node {node} carries more than one force: add their amplitudes")
    return State(
        found, _number("frequency", record.get("frequency", 0.0), FREQUENCY, "Hz"),
        _number("loss_factor", record.get("loss_factor", DEFAULT_LOSS_FACTOR), LOSS_FACTOR),
        choice("method", record.get("method", DEFAULT_METHOD), method_names()),
        choice("quantity", record.get("quantity", DEFAULT_QUANTITY), QUANTITIES),
        _cut(record.get("cut"), limits), probe_node(record.get("probe"), limits))


def from_query(query: str, limits: Limits) -> State:
    """A state from an address: the part after the question mark.

    Raises
    ------
    ValueError
        One sentence with the value, the rule and the remedy.
    """
    try:
        pairs = parse_qsl(query, keep_blank_values=True, max_num_fields=20, errors="strict")
    except ValueError as error:
        raise ValueError("the address cannot be read: open the page without what follows the question mark") from error
    words: dict[str, str] = {}
    for key, text in pairs:
        if key in words:
            raise ValueError(f"the address gives {shown(key)} twice: give it once")
        if key not in _KEYS and key not in PAGE_KEYS:
            raise ValueError(f"the address holds {shown(key)}, which the page does not know: it takes "
                             f"{', '.join([*_KEYS, *PAGE_KEYS])}")
        if key in PAGE_KEYS and not _PAGE_TEXT.fullmatch(text):
            raise ValueError(f"{key} is {shown(text)}: it can only hold numbers and words, 200 letters at most")
        words[key] = text
    record: dict[str, Any] = {}
    for key, name in _KEYS.items():
        if key in words:
            record[name] = _PARSERS[key](key, words[key])
    return from_json(record, limits)


def probe_node(value: Any, limits: Limits) -> int | None:
    """A node of the surface, or None; ValueError for anything else."""
    if value is None:
        return None
    return _node("probe", value, limits.surface_nodes, "is not on the surface: choose a vertex of the picture")


def _force(pair: Any, limits: Limits) -> tuple[int, float]:
    if not isinstance(pair, (list, tuple)) or len(pair) != 2:
        raise ValueError(f"a force is {shown(pair)}: give a pad node and its amplitude in newtons")
    node = _node("node", pair[0], limits.pad_nodes,
                 f"cannot carry a force: only the {len(limits.pad_nodes)} nodes of the pad can")
    amplitude = _number("force", pair[1], (-AMPLITUDE[1], AMPLITUDE[1]), "N")
    if abs(amplitude) < AMPLITUDE[0]:
        raise ValueError(f"force={amplitude:g} N cannot be: its magnitude must be {AMPLITUDE[0]:g} to {AMPLITUDE[1]:g}")
    return node, amplitude


def _node(name: str, value: Any, allowed: frozenset[int], rule: str) -> int:
    node = whole_number(name, value, 0)
    if node not in allowed:
        raise ValueError(f"node {shown(node)} {rule}")
    return node


def _number(name: str, value: Any, limits: tuple[float, float], unit: str = "") -> float:
    return real_number(name, value, *limits, unit=unit) + 0.0  # no negative zero


def _cut(value: Any, limits: Limits) -> tuple[str, float] | None:
    if value is None:
        return None
    if not isinstance(value, (list, tuple)) or len(value) != 2 or value[0] not in AXES:
        raise ValueError(f"the cut is {shown(value)}: give an axis (x, y or z) and a position in mm, or none")
    return str(value[0]), _number(f"cut along {value[0]}", value[1], limits.extent[value[0]], "mm")


def _parse_forces(_: str, text: str) -> list[list[float]]:
    pairs = []
    for part in text.split(",")[:MOST_FORCES + 1]:
        node, colon, amplitude = part.partition(":")
        if not colon:
            raise ValueError(f"forces is {shown(text)}: write NODE:NEWTONS, separated by commas")
        pairs.append([_parse_node("forces", node), _parse_number("forces", amplitude)])
    return pairs


def _parse_number(key: str, text: str) -> float:
    if not _NUMBER.fullmatch(text):
        raise ValueError(f"{key} holds {shown(text)}: write a finite number")
    return float(text)


def _parse_node(key: str, text: str) -> int:
    if not _NODE.fullmatch(text):
        raise ValueError(f"{key} holds {shown(text)}: write a node, a whole number of the mesh")
    return int(text)


def _parse_cut(key: str, text: str) -> list[Any] | None:
    if text == "none":
        return None
    axis, _, place = text.partition(":")
    return [axis, _parse_number(key, place)]


_PARSERS: dict[str, Any] = {
    "forces": _parse_forces, "f": _parse_number, "eta": _parse_number, "method": lambda _, text: text,
    "quantity": lambda _, text: text, "cut": _parse_cut, "probe": _parse_node}
