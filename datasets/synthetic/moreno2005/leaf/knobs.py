"""Knobs of the leaf among others."""

from typing import Annotated, Literal

from pydantic import Field

from datasets.synthetic.knobs import Knobs

__all__ = ["LeafKnobs"]


class LeafKnobs(Knobs):
    """What can be asked of `moreno2005/leaf`."""

    scene: Annotated[int, Field(ge=0, lt=2**32)] = Field(
        0, description="seed of all that is drawn at random: leaf, wind, foliage, sun, noise"
    )
    jump: Literal["start", "middle", "none"] = Field(
        "start",
        description="when the sun comes or goes all at once; start: between frames 0 and 1; "
        "middle: between frames 49 and 50; none: never",
    )
