"""Knobs of the suite's sequences."""

from typing import Annotated, Literal

from pydantic import Field

from datasets.synthetic.knobs import Knobs, Seed, seed
from datasets.synthetic.multipart.designs import WalkingKnobs

__all__ = ["DrivingKnobs", "HeadKnobs", "PersonKnobs", "StudentsKnobs"]


class PersonKnobs(WalkingKnobs):
    """What can be asked of `nummiaro2003/person`."""

    start: Literal["present", "empty"] = Field(
        "present",
        description="present: the target is in full view from the first frame on; empty: he "
        "comes in, through a door or from a side, after 60 frames without him",
    )


class StudentsKnobs(WalkingKnobs):
    """What can be asked of `nummiaro2003/students`."""

    tree: Annotated[int, Field(ge=1, le=3)] = Field(
        1, description="width of the tree that hides the target [times the ordinary one]"
    )


class DrivingKnobs(Knobs):
    """What can be asked of a scene with cars."""

    scene: Seed = seed("all that is drawn at random: place, cars, ways, camera")
    light: Literal["even", "dappled"] = Field(
        "even", description="even: an overcast sky; dappled: sun with the shade of trees"
    )


class HeadKnobs(Knobs):
    """What can be asked of `nummiaro2003/head`."""

    scene: Seed = seed("all that is drawn at random: worker, routine, machines, lamps")
    light: Literal["even", "lamps"] = Field(
        "even", description="even: a bright hall; lamps: lamps above the machines, dark between"
    )
    pace: Literal["brisk", "calm"] = Field(
        "brisk",
        description="brisk: he hurries from machine to machine, and his head moves by up to half "
        "of its half width a frame; calm: by up to 0.3 of it; the paper's claims are judged so",
        json_schema_extra={"later": True},
    )
