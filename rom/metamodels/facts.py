"""What methods say of themselves: the settings that a comparison runs, and what they ask of the full-order model."""

from __future__ import annotations

from typing import Any, ClassVar, NamedTuple

from rom.scenes import Scene


class Curve(NamedTuple):
    """Settings of one method in a comparison, and which of them is its headline: what speaks for it in tables."""

    settings: tuple[dict[str, Any], ...] = ({},)
    headline: int = -1


class Needs(NamedTuple):
    """What a method asks of the full-order model in `fit` and in its first answer."""

    stiffness: bool = True
    solves: bool = False
    """Whether it solves the scene's own equation, real or complex as the scene is."""
    modes: bool = False
    responses: bool = False
    """Whether static responses of the unit loads are computed."""
    other_mesh: bool = False
    network: bool = False
    regression: bool = False


class Facts:
    """What a method says of itself, on its class and nowhere else."""

    name: ClassVar[str]
    summary: ClassVar[str]
    """One plain sentence: what the method does."""
    learns: ClassVar[bool] = False
    """Whether it needs snapshots; if not, `fit` accepts None and looks at the full-order model alone."""
    seeded: ClassVar[bool] = False
    """Whether it takes a setting ``seed`` on which its weights hang."""
    full_order: ClassVar[bool] = False
    """Whether it solves the full-order model itself: what speed-ups are quoted against."""
    slow: ClassVar[int] = 1
    """One held-out case in so many is answered in a comparison, where each takes as long as the truth."""
    colour: ClassVar[str] = "#7f7f7f"
    """In figures."""
    suffix: ClassVar[str] = ".nc"
    """Of its files."""

    @classmethod
    def why_not(cls, scene: Scene) -> str | None:
        """Why the method does not apply to a scene, in one clause; None where it does."""
        return None

    @classmethod
    def curve(cls, scene: Scene) -> Curve:
        """The settings at which a comparison runs it."""
        return Curve()

    @classmethod
    def quick_curve(cls, scene: Scene) -> Curve:
        """The same for a coarse mesh and few cases: a check that everything runs."""
        return cls.curve(scene)

    @classmethod
    def needs(cls, scene: Scene) -> Needs:
        """What it asks of the full-order model."""
        return Needs()
