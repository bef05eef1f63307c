"""Knobs of the sea floor."""

from typing import Annotated

from pydantic import Field

from datasets.synthetic.knobs import Knobs

__all__ = ["OctopusKnobs"]


class OctopusKnobs(Knobs):
    """What can be asked of `moreno2005/octopus`."""

    scene: Annotated[int, Field(ge=0, lt=2**32)] = Field(
        0, description="seed of all that is drawn at random: animal, way, floor, light, noise"
    )
