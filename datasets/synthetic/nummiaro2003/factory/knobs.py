"""Knobs of the factory."""

from typing import Annotated, Literal

from pydantic import Field

from datasets.synthetic.knobs import Knobs

__all__ = ["HeadKnobs"]


class HeadKnobs(Knobs):
    """What can be asked of `nummiaro2003/head`."""

    scene: Annotated[int, Field(ge=0, lt=2**32)] = Field(
        0, description="seed of all that is drawn at random: worker, routine, machines, lamps"
    )
    light: Literal["even", "lamps"] = Field(
        "even", description="even: a bright hall; lamps: lamps above the machines, dark between"
    )
