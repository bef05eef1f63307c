"""Knobs of the scenes with cars."""

from typing import Annotated, Literal

from pydantic import Field

from datasets.synthetic.knobs import Knobs

__all__ = ["DrivingKnobs"]


class DrivingKnobs(Knobs):
    """What can be asked of a scene with cars."""

    scene: Annotated[int, Field(ge=0, lt=2**32)] = Field(
        0, description="seed of all that is drawn at random: place, cars, ways, camera"
    )
    light: Literal["even", "dappled"] = Field(
        "even", description="even: an overcast sky; dappled: sun with the shade of trees"
    )
