"""Knobs of the suite's sequences."""

from typing import Literal

from pydantic import Field

from datasets.synthetic.knobs import Knobs, Seed, seed

__all__ = ["FilmKnobs", "LightsKnobs"]


class FilmKnobs(Knobs):
    """What can be asked of `nguyen2002/clip-01` to `clip-20`."""

    scene: Seed = seed("a set of 20 clips: settings, targets, what hides them, ways, grain")


class LightsKnobs(Knobs):
    """What can be asked of `nguyen2002/lights`."""

    scene: Seed = seed("all that is drawn at random: object, way, occluders, room, noise")
    lamps: Literal["white", "coloured"] = Field(
        "white",
        description="white: both lamps are of nearly one colour; coloured: of clearly different "
        "colours",
    )
