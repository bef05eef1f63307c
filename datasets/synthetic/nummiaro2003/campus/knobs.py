"""Knobs of the scenes with people who come and go."""

from typing import Annotated, Literal

from pydantic import Field

from datasets.synthetic.multipart.knobs import WalkingKnobs

__all__ = ["PersonKnobs", "StudentsKnobs"]


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
