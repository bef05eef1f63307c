"""Knobs of the kitchen."""

from typing import Annotated, Literal

from pydantic import Field

from datasets.synthetic.knobs import Knobs

__all__ = ["CupKnobs"]


class CupKnobs(Knobs):
    """What can be asked of `wang2010/cup`."""

    scene: Annotated[int, Field(ge=0, lt=2**32)] = Field(
        0, description="seed of all that is drawn at random: cup, hand, way, kitchen, noise"
    )
    background: Literal["cluttered", "plain"] = Field(
        "cluttered",
        description="cluttered: something of nearly the cup's colour behind it and before it "
        "around frame 35; plain: a wall of another colour, and nothing before the cup",
    )
