"""Knobs of the scene with a hand."""

from typing import Annotated, Literal

from pydantic import Field

from datasets.synthetic.knobs import Knobs

__all__ = ["HandKnobs"]


class HandKnobs(Knobs):
    """What can be asked of `wang2010/hand`."""

    scene: Annotated[int, Field(ge=0, lt=2**32)] = Field(
        0, description="seed of all that is drawn at random: person, room, hand, way, noise"
    )
    background: Literal["face", "plain"] = Field(
        "face",
        description="face: somebody's face is in the way, in the hand's colour; plain: nobody, "
        "a wall of a contrasting colour",
    )
