"""Parameters of `plain/target`: one per difficulty; with the defaults the scene is easy."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from trackmark.datasets.synthetic.parameters import Seed, SequenceParameters, seed


class TargetParameters(SequenceParameters):
    """Parameters of `plain/target`."""

    scene: Seed = seed("all random properties: ground, colours, shapes, paths")
    length: Annotated[int, Field(ge=10, le=1_000_000)] = Field(
        120, description="length of the sequence [frames]"
    )
    width: Annotated[int, Field(ge=64, le=1920)] = Field(
        320, description="width of the images [pixels]"
    )
    height: Annotated[int, Field(ge=64, le=1080)] = Field(
        240, description="height of the images [pixels]; sizes of objects are proportional to it"
    )
    speed: Annotated[float, Field(ge=0, le=20)] = Field(
        2.0, description="speed of target and distractors in the image [pixels/frame]"
    )
    scale: Annotated[float, Field(ge=0.25, le=3)] = Field(
        1.0, description="size in the last frame relative to the first frame; changes steadily"
    )
    clutter: Annotated[int, Field(ge=0, le=20)] = Field(
        0, description="number of distractors in the target's colours; they pass below the target"
    )
    occlusion: Annotated[float, Field(ge=0, le=1)] = Field(
        0.0,
        description="fraction of the target that a passing board occludes when their centres "
        "coincide, at one third of the sequence",
    )
    absence: Annotated[int, Field(ge=0)] = Field(
        0,
        description="time for which the target is outside the image, around two thirds of the "
        "sequence; at most a third of the length [frames]",
    )
    light: Annotated[float, Field(ge=0, le=0.9)] = Field(
        0.0, description="fraction of the light that a cloud removes in the middle of the sequence"
    )
    noise: Annotated[float, Field(ge=0, le=40)] = Field(
        2.0, description="standard deviation of the sensor noise [grey levels]"
    )
    blur: Annotated[float, Field(ge=0, le=1)] = Field(
        0.0, description="fraction of the frame time for which the shutter is open"
    )
    pan: Annotated[float, Field(ge=0, le=20)] = Field(
        0.0,
        description="speed of the camera over the ground, relative to the target [pixels/frame]",
    )

    @model_validator(mode="after")
    def _absence_fits(self) -> Self:
        if self.absence > self.length // 3:
            raise ValueError(
                f"absence={self.absence} is more than a third of length={self.length}; "
                f"use at most {self.length // 3}"
            )
        return self
