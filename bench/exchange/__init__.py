"""Import and export of results in formats of other toolkits, one module each in `formats`."""

from functools import cache
from importlib import import_module
from pathlib import Path

from trackmark.bench.exchange.result_format import ExchangeError, ResultFormat
from trackmark.datasets.spec_string import name_hint

_FOLDER = Path(__file__).parent / "formats"


@cache
def format_names() -> list[str]:
    """Return the sorted names of the result formats, which are the names of their modules."""
    return sorted(file.stem.replace("_", "-") for file in _FOLDER.glob("[a-z]*.py"))


def load_format(name: str) -> ResultFormat:
    """Return the result format with a name; raise `ExchangeError` for an unknown name."""
    if name not in format_names():
        hint = name_hint(name, format_names())
        raise ExchangeError(f"Unknown result format {name!r}.{hint}")
    module = import_module(f"trackmark.bench.exchange.formats.{name.replace('-', '_')}")
    result_format: ResultFormat = module.FORMAT
    return result_format


def detect_format(folder: Path) -> str:
    """Return the format of the first result file in a tracker's folder.

    Raises `ExchangeError` if the format is unknown.
    """
    require_folder(folder)
    for name in format_names():
        candidate = load_format(name)
        files = candidate.files(folder) if candidate.fits else {}
        if candidate.fits and files and candidate.fits(files[min(files)][0]):
            return name
    content = ", ".join(sorted(path.name for path in folder.iterdir())[:3])
    expected = "; ".join(f"{load_format(name).expects} ({name})" for name in format_names())
    raise ExchangeError(
        f"{folder}: unknown result format (the folder contains {content or 'nothing'}). "
        f"Expected: {expected}."
    )


def require_folder(folder: Path) -> None:
    """Raise `ExchangeError` if the path does not lead to a folder."""
    if not folder.is_dir():
        raise ExchangeError(f"{folder}: not a folder. Expected: a folder with a tracker's results.")
