"""Knobs of the suite's sequences."""

from typing import Literal

from pydantic import Field

from datasets.synthetic.knobs import Knobs, Seed, seed

__all__ = ["CupKnobs", "HandKnobs", "TableTennisKnobs"]


class TableTennisKnobs(Knobs):
    """What can be asked of `wang2010/table-tennis`."""

    scene: Seed = seed("all that is drawn at random: wall, player, light, strokes, noise")
    version: int = Field(
        1,
        ge=1,
        le=2,
        description="1: the ball is as bright as the wall, and arm, bat and ball are flung up "
        "together; 2: it is half as bright, and tipped up by the wrist, the arm being slow",
        json_schema_extra={"later": True},
    )


class HandKnobs(Knobs):
    """What can be asked of `wang2010/hand`."""

    scene: Seed = seed("all that is drawn at random: person, room, hand, way, noise")
    background: Literal["face", "plain"] = Field(
        "face",
        description="face: somebody's face is in the way, in the hand's colour; plain: nobody, "
        "a wall of a contrasting colour",
    )


class CupKnobs(Knobs):
    """What can be asked of `wang2010/cup`."""

    scene: Seed = seed("all that is drawn at random: cup, hand, way, kitchen, noise")
    background: Literal["cluttered", "plain"] = Field(
        "cluttered",
        description="cluttered: something of nearly the cup's colour behind it and before it "
        "around frame 35; plain: a wall of another colour, and nothing before the cup",
    )
