"""Knobs of the film's clips."""

from typing import Annotated

from pydantic import Field

from datasets.synthetic.knobs import Knobs

__all__ = ["FilmKnobs"]


class FilmKnobs(Knobs):
    """What can be asked of `nguyen2002/clip-01` to `clip-20`."""

    scene: Annotated[int, Field(ge=0, lt=2**32)] = Field(
        0, description="seed of a set of 20 clips: settings, targets, what hides them, ways, grain"
    )
