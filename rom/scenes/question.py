"""What is asked of a linear body, in words, ranges and units that do not depend on its matrices."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from rom.bodies import Body, Loads
from rom.scenes.inputs import Input

FREQUENCY = Input("frequency", "Hz", "excitation frequency", "excitation frequency")
LOSS_FACTOR = Input("loss_factor", "1", "loss factor eta of K (1 + i eta)", "loss factor eta of K (1 + i eta)")
AMPLITUDE = Input("force_amplitude", "N", "any [N]; the model is linear", "force amplitude", ("case", "force"))
PHASE = Input("force_phase", "rad", "any [rad], f(t) = a cos(2 pi frequency t + phase) (default 0)",
              "phase of the force, f(t) = a cos(2 pi frequency t + phase)", ("case", "force"), default=0.0)


@dataclass(frozen=True)
class Question:
    """What is asked of a body, in words and numbers that do not depend on its matrices.

    Parameters
    ----------
    name, title, question : str
    harmonic : bool
        Whether the forces vibrate; if not, no mass and no complex number is ever touched.
    gate : float
    loads : tuple of Input
        The variables that name a load; as many as the loads have labels.
    points : tuple of Input
        Frequency and loss factor of harmonic questions.
    phases : bool
        Whether simultaneous forces have phases.
    amplitude : Input
    max_forces : int
        Simultaneous forces in the sampled range; more are extrapolation.
    needs, leaves_out : dict of str
    part, part_words : str
        Name of the smaller output, and the same in words.
    spatial : bool
        Whether the loads have positions and normals that a method can interpolate over.
    """

    name: str
    title: str
    question: str
    harmonic: bool
    gate: float = 0.01
    loads: tuple[Input, ...] = ()
    points: tuple[Input, ...] = ()
    phases: bool = False
    amplitude: Input = AMPLITUDE
    max_forces: int = 1
    needs: Mapping[str, str] = field(default_factory=dict)
    leaves_out: Mapping[str, str] = field(default_factory=dict)
    part: str = ""
    part_words: str = "chosen outputs"
    spatial: bool = False

    @property
    def inputs(self) -> tuple[Input, ...]:
        """All that varies."""
        return (*self.loads, self.amplitude, *((PHASE,) if self.phases else ()), *self.points)


def default_question(body: Body, loads: Loads | Callable[[], Loads], name: str | None, frequency: tuple[float, float],
                     loss_factor: tuple[float, float], part: bool) -> Question:
    """One force at a named load of a body, harmonic where it has a mass."""
    harmonic = body.has_mass
    made = loads() if callable(loads) else loads
    return Question(
        name or f"{body.name}-{'harmonic' if harmonic else 'static'}-force",
        f"{'Vibrating' if harmonic else 'Steady'} force on {body.name}",
        f"How does {body.name} {'vibrate' if harmonic else 'deform'} under one force at a named place?",
        harmonic, gate=0.05 if harmonic else 0.01,
        loads=tuple(Input(label, "" if values.dtype.kind in "UO" else "1", "a name of the scene's loads", "load",
                          ("case", "force")) for label, values in made.labels.items()),
        points=(Input("frequency", "Hz", f"{frequency[0]:g} to {frequency[1]:g} Hz", FREQUENCY.long_name,
                      range=frequency),
                Input("loss_factor", "1", f"{loss_factor[0]:g} to {loss_factor[1]:g}", LOSS_FACTOR.long_name,
                      range=loss_factor)) if harmonic else (),
        amplitude=Input("force_amplitude", "N", AMPLITUDE.text, AMPLITUDE.long_name, AMPLITUDE.dims, (0.1, 1.0)),
        needs={"stiffness": "K, real symmetric"} | ({"mass matrix": "M, real symmetric"} if harmonic else {}),
        leaves_out={} if harmonic else {"mass matrix": "nothing moves: M never enters K u = f"},
        part="part" if part else "", spatial=made.position is not None and made.direction is not None)
