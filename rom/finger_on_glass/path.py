"""A load path: the plate is pressed on, then moved along under constant normal force; steps adapt, positions are met.

Where no step converges however small, a viscous resistance of the skin carries the path over: quasi-static equilibria
end there (a snap), and the motion goes on in time. It is raised only then, and every observation says how much there
is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import pairwise

from rom.checks import real_number, shown
from rom.finger_on_glass.equilibrium import ConvergedStep, FailedStep, StepResult, solve_step
from rom.finger_on_glass.finger import Finger, State
from rom.finger_on_glass.observation import Balance, Observation, observe, plate_forces
from rom.finger_on_glass.tissue import FIBRE_CAP

FIRST_TOUCH, TOUCHES = 0.02, 14
"""Approach of the plate that closes the contact, before its force is prescribed [mm]; halved so often at most."""
VISCOSITIES = (0.0, 1e-5, 3e-5, 1e-4)
"""Viscous resistances, tried in turn [MPa]."""
QUICK_ITERATIONS = 7


@dataclass(frozen=True)
class LoadPath:
    """Positions at which the path is recorded.

    Parameters
    ----------
    normal_force : tuple of float [N]
        Ascending; the last one is held while the plate moves along.
    travel : tuple of float [mm]
        Ascending positions of the plate; may be empty.

    Raises
    ------
    ValueError
    """

    normal_force: tuple[float, ...] = (0.1, 0.2, 0.3, 0.4, 0.5)
    travel: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        for name, unit in (("normal_force", "N"), ("travel", "mm")):
            values = getattr(self, name)
            if isinstance(values, str) or not hasattr(values, "__iter__"):
                raise ValueError(f"{name}={shown(values)} is no list of positions: give ascending numbers of {unit}")
            values = tuple(real_number(name, value, above=0.0, most=1e3, unit=unit) for value in values)
            object.__setattr__(self, name, values)
            if any(b <= a for a, b in pairwise(values)):
                raise ValueError(f"{name}={shown(values)} is no path: give ascending positions in {unit}")
        if not self.normal_force:
            raise ValueError("the path has no normal force: give at least one position in N")


@dataclass(frozen=True, eq=False)
class PathAnswer:
    """A path as far as it went."""

    observations: list[Observation] = field(default_factory=list)
    """One for each position that was reached, in order."""
    last: Observation | None = None
    """The last converged step, on a position or not; the finger at rest where there is none."""
    complete: bool = True
    reason: str = ""
    """One sentence on where and why the path ended early."""


@dataclass(frozen=True)
class StepLimits:
    """First, largest and least step, of a stage's own quantity."""

    first: float
    largest: float
    least: float


def follow(finger: Finger, path: LoadPath, *, viscosities: tuple[float, ...] = VISCOSITIES,
           on_step: Callable[[Observation], None] | None = None) -> PathAnswer:
    """Follow a path from the undeformed finger.

    Parameters
    ----------
    finger : Finger
    path : LoadPath
    viscosities : tuple of float [MPa]
        Tried in turn where no step converges; the first is used from the start.
    on_step : callable, optional
        Called with every converged step.

    Returns
    -------
    PathAnswer
        With ``complete`` false and a ``reason`` where the path ended early; what was reached is there all the same.
    """
    walk = _Walk(finger, viscosities, on_step)
    observations: list[Observation] = []
    try:
        for target in walk.targets(path):
            observations.append(target)
    except _Stuck as stuck:
        return PathAnswer(observations, walk.last, False, str(stuck))
    return PathAnswer(observations, walk.last)


class _Stuck(Exception):
    """No step converges, however small and however viscous."""


class _Walk:
    """Where a path has got to."""

    def __init__(self, finger: Finger, viscosities: tuple[float, ...], on_step: Callable | None) -> None:
        self.finger, self.viscosities, self.on_step = finger, viscosities, on_step
        self.state: State = finger.at_rest()
        self.balance = Balance()
        self.level = self.iterations = self.steps = 0
        found = finger.residual(self.state, self.state.contact, 0.0)
        self.last = observe(finger, ConvergedStep(self.state, found, 0, 0.0), self.balance, 0.0, 0, 0)
        self.normal = 0.0
        """Force on the plate [N/mm]."""

    def targets(self, path: LoadPath) -> Iterator[Observation]:
        """Reach each position in turn."""
        length = self.finger.out_of_plane.effective_length
        full = path.normal_force[-1] / length
        self._touch(path.normal_force[0] / length)
        first = min(0.05 * full, 0.25 * path.normal_force[0] / length)
        limits = StepLimits(first, 0.25 * full, 1e-5 * full)
        reached, step = self.normal, limits.first
        for force in path.normal_force:
            reached, step = self._ramp(reached, force / length, step, limits, lambda f: {"normal_force": f},
                                       lambda f: f"{f * length:.4g} N of normal force")
            yield self.last
        limits = StepLimits(0.05, 0.2, 1e-4)
        reached, step = 0.0, limits.first
        for x in path.travel:
            reached, step = self._ramp(reached, x, step, limits, lambda x: {"normal_force": full, "plate_x": x},
                                       lambda x: f"{x:.4g} mm of travel", viscous=True)
            yield self.last

    def _touch(self, force: float) -> None:
        """Close the contact by moving the plate, so gently that the first force is not passed."""
        rest, approach = self.state, FIRST_TOUCH
        for _ in range(TOUCHES):
            step = solve_step(self.finger, rest, plate_y=self.finger.lowest + approach)
            self.iterations += step.iterations
            if isinstance(step, ConvergedStep):
                contact = step.residual.contact
                if 0 < plate_forces(self.finger, contact.pressure, contact.shear)[0] < force:
                    self._accept(step, 0.0)
                    return
            approach *= 0.5
        if isinstance(step, FailedStep):
            raise _Stuck(f"the path ends before the plate touches: {step.reason} however small the approach; the "
                         "finger is left at rest: give a stiffer tissue or softer penalties")
        raise _Stuck(f"the path ends where the plate touches: its first force of "
                     f"{force * self.finger.out_of_plane.effective_length:g} N is passed by the smallest approach; the "
                     "finger is left at rest: give a larger first force")

    def _ramp(self, reached: float, target: float, step: float, limits: StepLimits, control: Callable[[float], dict],
              say: Callable[[float], str], viscous: bool = False) -> tuple[float, float]:
        """From ``reached`` to ``target``; the next step's size comes back too."""
        while target - reached > 1e-12:
            size = min(step, target - reached)
            if target - reached - size < 0.2 * size:  # no sliver for the last step
                size = target - reached
            viscosity = self.viscosities[self.level]
            found: StepResult = solve_step(self.finger, self.state, viscosity=viscosity, **control(reached + size))
            self.iterations += found.iterations
            if isinstance(found, ConvergedStep) and found.residual.largest_fibre > FIBRE_CAP:
                found = FailedStep(found.iterations, "a fibre is stretched to lambda^2 - 1 = "
                                   f"{found.residual.largest_fibre:.2f}, beyond the cap of {FIBRE_CAP:g},")
            if isinstance(found, FailedStep):
                step = 0.5 * size
                if step < limits.least:
                    if viscous and self.level + 1 < len(self.viscosities):
                        self.level += 1
                        step = limits.first
                        continue
                    raise _Stuck(f"the path ends at {say(reached)}, where {found.reason} however small the step; the "
                                 "last converged step is kept: give a stiffer tissue, less friction or less load")
                continue
            reached += size
            self._accept(found, viscosity)
            if found.iterations <= QUICK_ITERATIONS:
                step = min(1.5 * max(step, size), limits.largest)
        return target, step

    def _accept(self, found: ConvergedStep, viscosity: float) -> None:
        self.balance.add(self.finger, self.state, found, viscosity)
        self.normal = plate_forces(self.finger, found.residual.contact.pressure, found.residual.contact.shear)[0]
        self.state = found.state
        self.steps += 1
        self.last = observe(self.finger, found, self.balance, viscosity, self.iterations, self.steps)
        if self.on_step:
            self.on_step(self.last)
