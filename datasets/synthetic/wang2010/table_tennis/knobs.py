"""Knobs of the table tennis scene."""

from typing import Annotated

from pydantic import Field

from datasets.synthetic.knobs import Knobs

__all__ = ["TableTennisKnobs"]


class TableTennisKnobs(Knobs):
    """What can be asked of `wang2010/table-tennis`."""

    scene: Annotated[int, Field(ge=0, lt=2**32)] = Field(
        0, description="seed of all that is drawn at random: wall, player, light, strokes, noise"
    )
