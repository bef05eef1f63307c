"""Knobs of the walking scenes."""

from typing import Annotated, Literal

from pydantic import Field

from datasets.synthetic.knobs import Knobs

__all__ = ["TwinKnobs", "WalkingKnobs"]


class WalkingKnobs(Knobs):
    """What can be asked of every walking scene."""

    scene: Annotated[int, Field(ge=0, lt=2**32)] = Field(
        0, description="seed of all that is drawn at random: street, clothes, paths, camera"
    )
    light: Literal["even", "dappled"] = Field(
        "even", description="even: an overcast sky; dappled: sun with the shade of trees"
    )


class TwinKnobs(WalkingKnobs):
    """What can be asked of `stress/twin`."""

    distance: Annotated[float, Field(ge=0, le=3)] = Field(
        0.0,
        description="between the axes of the target and the second person where they come "
        "closest in the image, sideways [widths of the target's box]",
    )
    twin: Literal["same", "other"] = Field(
        "same", description="clothes of the second person: the target's, or of other colours"
    )
