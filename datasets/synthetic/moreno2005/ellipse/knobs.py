"""Knobs of the ellipse before clutter."""

from typing import Annotated, Literal

from pydantic import Field

from datasets.synthetic.knobs import Knobs

__all__ = ["Clutter", "EllipseKnobs"]

Clutter = Literal["dense", "moderate"]


class EllipseKnobs(Knobs):
    """What can be asked of `moreno2005/ellipse`."""

    scene: Annotated[int, Field(ge=0, lt=2**32)] = Field(
        0, description="seed of all that is drawn at random: way, shape, colours, clutter, noise"
    )
    light: Literal["even", "jump", "repeated", "shadow"] = Field(
        "even",
        description="even: it stays; jump: it changes abruptly once, at mid-sequence; repeated: at "
        "random moments, each time until the next; shadow: the edge of a coloured shadow passes "
        "over the scene",
    )
    clutter: Clutter = Field(
        "dense",
        description="dense: 140 shapes behind, and patches of the ellipse's colour that it meets "
        "while it has it; moderate: 90 shapes, and every 18 frames two patches at 18 to 45 pixels "
        "from its centre; moderate was added after trackers had been run on dense",
    )
