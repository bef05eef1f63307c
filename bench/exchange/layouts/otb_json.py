"""JSON a sequence, `SEQ.json`, with the boxes as `res`, x and y from 1: OTB's Python toolkit.

A file holds an object, or a list of one; those of shifted starts (`SRE`, `TRE`) hold several.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from bench.exchange.layout import ExchangeError, Layout, Said, by_sequence, file_name, text_of

__all__ = ["LAYOUT"]


def files(folder: Path) -> Mapping[str, list[Path]]:
    """Files by sequence."""
    return by_sequence(folder, "*.json")


def read(file: Path) -> Said:
    """Boxes of a run in one pass, given as rectangles."""
    try:
        told: Any = json.loads(text_of(file))
    except ValueError as error:  # a whole number of thousands of digits, too
        line = getattr(error, "lineno", 1)
        raise ExchangeError(f"{file}, line {line}: this is no JSON ({error}).") from error
    except RecursionError as error:
        raise ExchangeError(f"{file}: this is nested too deeply.") from error
    one = told[0] if isinstance(told, list) and len(told) == 1 else told
    if not isinstance(one, dict) or not isinstance(one.get("res"), list):
        raise ExchangeError(f"{file}: expected is an object with boxes as `res`, or a list of one.")
    kind = one.get("resType", "rect"), one.get("evalType", "OPE")
    if kind != ("rect", "OPE"):
        raise ExchangeError(f"{file}: {kind[0]} of {kind[1]}; read are rect of OPE.")
    for number, box in enumerate(one["res"], 1):
        if not (
            isinstance(box, list)
            and len(box) == 4
            and all(type(value) in (int, float) and not abs(value) > 1e300 for value in box)
        ):
            said = json.dumps(box)[:60]
            raise ExchangeError(f"{file}, box {number}: {said} are not x, y, width, height.")
    return Said(np.array(one["res"], np.float64).reshape(-1, 4))


def write(folder: Path, sequence: str, repetition: int, said: Said) -> Mapping[Path, str]:
    """JSON of a run."""
    frames = len(said.boxes)
    first = int(np.isfinite(said.boxes).all(axis=1).argmax())
    times = np.empty(0) if said.seconds is None else said.seconds[first + 1 :]  # of updates
    times = times[np.isfinite(times)]
    told = {
        "tracker": folder.name,
        "seqName": sequence,
        "startFrame": 1,
        "endFrame": frames,
        "evalType": "OPE",
        "fps": 1 / float(times.mean()) if times.sum() else None,
        "shiftType": None,
        "resType": "rect",
        "tmplsize": None,
        "res": np.nan_to_num(said.boxes).tolist(),
    }
    return {folder / f"{file_name(sequence)}.json": json.dumps([told]) + "\n"}


LAYOUT = Layout(
    expects='SEQ.json with "res": [[x, y, width, height], …]',
    holds="boxes to the last digit (zeros where there is none); no confidence",
    origin=1,
    files=files,
    fits=lambda file: file.suffix == ".json",
    read=read,
    write=write,
    held=np.nan_to_num,
    row="box",
)
