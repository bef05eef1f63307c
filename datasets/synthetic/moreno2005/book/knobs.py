"""Knobs of the bending book."""

from typing import Annotated, Literal

from pydantic import Field

from datasets.synthetic.knobs import Knobs

__all__ = ["BookKnobs"]


class BookKnobs(Knobs):
    """What can be asked of `moreno2005/book`."""

    scene: Annotated[int, Field(ge=0, lt=2**32)] = Field(
        0, description="seed of all that is drawn at random: book, bending, way, room, noise"
    )
    illuminant: Literal["changing", "constant"] = Field(
        "changing",
        description="changing: the light turns smoothly from natural to yellow; constant: it "
        "stays natural",
    )
    shadow: Literal["self", "none"] = Field(
        "self",
        description="self: the book shades itself where it turns from the light and where a part "
        "is in another's way; none: it is lit everywhere as if it were flat",
    )
