"""Others' results read, ours written for their tools: a layout a file in `formats`."""

from functools import cache
from importlib import import_module
from pathlib import Path

from trackmark.bench.exchange.result_format import ExchangeError, Layout
from trackmark.datasets.spec_string import close_match

__all__ = ["layout", "names", "sniffed"]

_FOLDER = Path(__file__).parent / "formats"


@cache
def names() -> list[str]:
    """Names of the layouts, sorted: a file each, found by its name."""
    return sorted(file.stem.replace("_", "-") for file in _FOLDER.glob("[a-z]*.py"))


def layout(name: str) -> Layout:
    """Layout of a name.

    Raises `ExchangeError` for an unknown one, with those that are known.
    """
    if name not in names():
        hint = close_match(name, names())
        raise ExchangeError(f"unknown layout {name!r}.{hint} Known: {', '.join(names())}.")
    module = import_module(f"trackmark.bench.exchange.formats.{name.replace('-', '_')}")
    found: Layout = module.LAYOUT
    return found


def sniffed(folder: Path) -> str:
    """Name of the layout that a tracker's folder of results has.

    Raises `ExchangeError` where it has none, with what was looked for and what there is.
    """
    if not folder.is_dir():
        raise ExchangeError(f"{folder} is no folder with a tracker's results.")
    for name in names():
        one = layout(name)
        if one.fits and (files := one.files(folder)) and one.fits(files[min(files)][0]):
            return name
    there = ", ".join(sorted(path.name for path in folder.iterdir())[:3])
    wanted = "; ".join(f"{layout(name).expects} ({name})" for name in names())
    raise ExchangeError(
        f"{folder}: these are no results of a layout that is read. Looked for: {wanted}. "
        f"There is {there or 'nothing'}."
    )
