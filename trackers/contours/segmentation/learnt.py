"""A parameter that names a file of learnt dynamics, and holds what is in it."""

from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel, ConfigDict, model_validator

from trackers.contours.segmentation.dynamics import read_dynamics

__all__ = ["LearntDynamics"]


class LearntDynamics(BaseModel):
    """Values of parameters by name, from a file that `trackmark learn` wrote.

    In text it is the file's name. A run's identity holds the values too, so that a file that was
    written anew makes other runs.

    Attributes
    ----------
    file : str
        The file; empty for none.
    values : mapping of str to float
        What it says.
    """

    model_config = ConfigDict(frozen=True)

    file: str = ""
    values: Mapping[str, float] = {}

    @model_validator(mode="before")
    @classmethod
    def _read(cls, given: Any) -> Any:
        if isinstance(given, str):
            return {"file": given, "values": read_dynamics(given) if given else {}}
        return given

    def __str__(self) -> str:
        return self.file
