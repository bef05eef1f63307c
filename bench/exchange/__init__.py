"""Import and export of results in the formats of other toolkits."""

from collections.abc import Mapping
from pathlib import Path

from trackmark.bench.exchange.otb_json import OtbJsonFormat
from trackmark.bench.exchange.result_format import ExchangeError, ResultFormat
from trackmark.bench.exchange.text_format import TextFormat
from trackmark.bench.exchange.vot import VotFormat
from trackmark.datasets.spec_string import name_hint

_VOT = VotFormat()

FORMATS: Mapping[str, ResultFormat] = {
    "got10k": TextFormat(
        expects="SEQ/SEQ_001.txt with x,y,width,height per line",
        exports="boxes to 3 decimals; times of the first repetition; no confidence",
        decimals=3,
        has_repetitions=True,
        has_times=True,
    ),
    "otb": TextFormat(
        expects="SEQ.txt with x,y,width,height per line",
        exports="boxes to 4 decimals; no confidence, no times",
        missing_row="not scored",
    ),
    "otb-json": OtbJsonFormat(),
    # The one-pass data sets of pysot (OTB, LaSOT, UAV, NfS) have text files. VOT-LT has files of
    # VOT with confidences.
    "pysot": TextFormat(
        expects="SEQ.txt, or longterm/SEQ/SEQ_001.txt",
        exports="boxes to 4 decimals; confidence, in files of VOT's longterm; no times",
        vot=_VOT,
    ),
    "pytracking": TextFormat(
        expects="SEQ.txt with x, y, width, height between tabs",
        exports="boxes truncated to whole pixels (zeros if missing); confidence; no times",
        separator="\t",
        decimals=0,
        missing_row="a miss",
        confidence_suffix="_object_presence_scores.txt",
    ),
    "vot": _VOT,
}
"""Result formats by name, in the order in which they are tried on a folder."""


def find_format(name: str) -> ResultFormat:
    """Return the result format with a name; raise `ExchangeError` for an unknown name."""
    if name not in FORMATS:
        raise ExchangeError(f"Unknown result format {name!r}.{name_hint(name, sorted(FORMATS))}")
    return FORMATS[name]


def detect_format(folder: Path) -> str:
    """Return the name of the format of the first result file in a tracker's folder.

    Raises `ExchangeError` if the format is unknown.
    """
    require_folder(folder)
    for name, candidate in FORMATS.items():
        files = candidate.files(folder)
        if files and candidate.recognises(files[min(files)][0]):
            return name
    first_names = ", ".join(sorted(path.name for path in folder.iterdir())[:3])
    expected = "; ".join(f"{candidate.expects} ({name})" for name, candidate in FORMATS.items())
    raise ExchangeError(
        f"{folder}: unknown result format (the folder contains {first_names or 'nothing'}). "
        f"Expected: {expected}."
    )


def require_folder(folder: Path) -> None:
    """Raise `ExchangeError` if the path does not lead to a folder."""
    if not folder.is_dir():
        raise ExchangeError(f"{folder}: not a folder. Expected: a folder with a tracker's results.")
