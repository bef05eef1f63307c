"""Files of dynamics: deviations of the random walks, learnt off-line from segmented sequences.

```toml
plane_spread = 0.2513      # parameters of trackers, each 0 or more
stretch_x_spread = 0.02471

[learnt]                   # where they come from; nothing reads it
colour_dynamics = "shared"

[[learnt.sequences]]
name = "moreno2005/ellipse:scene=100"
fingerprint = "..."
steps = 99
```
"""

import tomllib
from collections.abc import Mapping
from math import isfinite
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, model_validator

from trackers.base.parameters import TrackerError, unknown

__all__ = ["LEARNT", "LearntDynamics", "read_dynamics"]

LEARNT = (
    "plane_spread",
    "stretch_x_spread",
    "shear_x_spread",
    "shear_y_spread",
    "stretch_y_spread",
    "shift_x_spread",
    "shift_y_spread",
    "mean_spread",
    "class_spread",
    "gain_spread",
    "jump_probability",
    "jump_spread",
    "prior_spread",
    "eigenvalue_spread",
    "angle_spread",
)
"""Parameters that can be learnt."""


def read_dynamics(path: str | Path) -> dict[str, float]:
    """Values of parameters by name, from a file.

    Raises
    ------
    TrackerError
        Where there is no such file, or it is no TOML, names what can't be learnt, or has a value
        out of range; the message says which.
    """
    try:
        content = tomllib.loads(Path(path).read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise TrackerError(f"{path}: {error.strerror}. Give a file of dynamics.") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise TrackerError(f"{path}: not TOML ({error}).") from None
    values = {}
    for name, value in content.items():
        if name == "learnt":
            continue
        if name not in LEARNT:
            raise unknown(f"parameter in {path}", name, LEARNT)
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise TrackerError(f"{path}: {name}={value!r} is not a number.")
        if not isfinite(value) or value < 0 or (name == "jump_probability" and value > 1):
            span = "between 0 and 1" if name == "jump_probability" else "0 or more"
            raise TrackerError(f"{path}: {name}={value} is out of range; give {span}.")
        values[name] = float(value)
    if not values:
        raise TrackerError(f"{path}: there are no values; known are {', '.join(LEARNT)}.")
    return values


class LearntDynamics(BaseModel):
    """A parameter: values of others by name, from a file.

    In text it is the file's name, empty for none. A run's identity holds the values too, so that a
    file that was written anew makes other runs.
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
