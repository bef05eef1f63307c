"""Knobs of the ellipse before clutter."""

from typing import Annotated, Literal

from pydantic import Field

from datasets.synthetic.engine.knobs import Knobs

__all__ = ["EllipseKnobs"]


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
