"""Knobs of the suite's sequences."""

from typing import Literal

from pydantic import Field

from datasets.synthetic.knobs import Knobs, Seed, seed

__all__ = ["BookKnobs", "Clutter", "EllipseKnobs", "LeafKnobs", "OctopusKnobs", "Steps"]

Clutter = Literal["dense", "moderate"]
Steps = Literal["persistent", "independent"]


class EllipseKnobs(Knobs):
    """What can be asked of `moreno2005/ellipse`."""

    scene: Seed = seed("all that is drawn at random: way, shape, colours, clutter, noise")
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
        "from its centre; what is found in it is post hoc",
    )
    steps: Steps = Field(
        "persistent",
        description="persistent: what changes its shape goes on for frames on end, and it meets "
        "its colour every 12 to 22 frames; independent: every frame's step of its shape is a new "
        "one, and it meets its colour three times",
        json_schema_extra={"later": True},
    )


class OctopusKnobs(Knobs):
    """What can be asked of `moreno2005/octopus`."""

    scene: Seed = seed("all that is drawn at random: animal, way, floor, light, noise")
    camouflage: float = Field(
        0.9,
        ge=0,
        le=1,
        description="how much of a floor's look the skin takes on, of 1; the rest stays its own",
        json_schema_extra={"later": True},
    )


class BookKnobs(Knobs):
    """What can be asked of `moreno2005/book`."""

    scene: Seed = seed("all that is drawn at random: book, bending, way, room, noise")
    illuminant: Literal["changing", "constant"] = Field(
        "changing",
        description="changing: the light turns smoothly from natural to yellow; constant: it "
        "stays natural",
    )
    shadow: Literal["self", "none"] = Field(
        "self",
        description="self: the book shades itself where it turns from the light and where a part "
        "is in another's way; none: it is lit everywhere as if it were flat",
    )


class LeafKnobs(Knobs):
    """What can be asked of `moreno2005/leaf`."""

    scene: Seed = seed("all that is drawn at random: leaf, wind, foliage, sun, noise")
    jump: Literal["start", "middle", "none"] = Field(
        "start",
        description="when the sun comes or goes all at once; start: between frames 0 and 1; "
        "middle: between frames 49 and 50; none: never",
    )
