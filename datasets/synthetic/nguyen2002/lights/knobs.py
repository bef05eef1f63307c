"""Knobs of the room with two lamps."""

from typing import Annotated, Literal

from pydantic import Field

from datasets.synthetic.knobs import Knobs

__all__ = ["LightsKnobs"]


class LightsKnobs(Knobs):
    """What can be asked of `nguyen2002/lights`."""

    scene: Annotated[int, Field(ge=0, lt=2**32)] = Field(
        0, description="seed of all that is drawn at random: object, way, occluders, room, noise"
    )
    lamps: Literal["white", "coloured"] = Field(
        "white",
        description="white: both lamps are of nearly one colour; coloured: of clearly different "
        "colours",
    )
