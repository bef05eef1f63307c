"""Parameters of `plain/target`: one per difficulty, all easy by default."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from trackmark.datasets.synthetic.knobs import Knobs, Seed, seed


class TargetKnobs(Knobs):
    """Parameters of `plain/target`."""

    scene: Seed = seed("all that is drawn at random: ground, colours, shapes, paths")
    length: Annotated[int, Field(ge=10, le=1_000_000)] = Field(
        120, description="length of the sequence [frames]"
    )
    width: Annotated[int, Field(ge=64, le=1920)] = Field(320, description="of the images [pixels]")
    height: Annotated[int, Field(ge=64, le=1080)] = Field(
        240, description="of the images [pixels]; sizes of objects follow it"
    )
    speed: Annotated[float, Field(ge=0, le=20)] = Field(
        2.0, description="of the target and the distractors in the image [pixels/frame]"
    )
    scale: Annotated[float, Field(ge=0.25, le=3)] = Field(
        1.0, description="size in the last frame over size in the first; changes steadily"
    )
    clutter: Annotated[int, Field(ge=0, le=20)] = Field(
        0, description="distractors in the target's colours; they pass below the target"
    )
    occlusion: Annotated[float, Field(ge=0, le=1)] = Field(
        0.0,
        description="fraction of the target that is hidden when a board passes over its middle, "
        "at one third of the sequence",
    )
    absence: Annotated[int, Field(ge=0)] = Field(
        0,
        description="time for which the target is out of view, around two thirds of the "
        "sequence; at most a third of the length [frames]",
    )
    light: Annotated[float, Field(ge=0, le=0.9)] = Field(
        0.0, description="fraction of the light that a passing cloud takes in mid-sequence"
    )
    noise: Annotated[float, Field(ge=0, le=40)] = Field(
        2.0, description="standard deviation of the sensor's noise [grey levels]"
    )
    blur: Annotated[float, Field(ge=0, le=1)] = Field(
        0.0, description="fraction of the frame time for which the shutter is open"
    )
    pan: Annotated[float, Field(ge=0, le=20)] = Field(
        0.0, description="of the camera over the ground, relative to the target [pixels/frame]"
    )

    @model_validator(mode="after")
    def _absence_fits(self) -> Self:
        if self.absence > self.length // 3:
            raise ValueError(
                f"absence={self.absence} is more than a third of length={self.length}; "
                f"take at most {self.length // 3}"
            )
        return self
