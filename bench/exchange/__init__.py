"""Import of other toolkits' results and export of ours: a layout is a file in `formats`."""

from functools import cache
from importlib import import_module
from pathlib import Path

from trackmark.bench.exchange.result_format import ExchangeError, Layout
from trackmark.datasets.spec_string import close_match

_FOLDER = Path(__file__).parent / "formats"


@cache
def names() -> list[str]:
    """Return the sorted names of the layouts, which are those of their files."""
    return sorted(file.stem.replace("_", "-") for file in _FOLDER.glob("[a-z]*.py"))


def layout(name: str) -> Layout:
    """Return the layout of a name; raise `ExchangeError` if there is none."""
    if name not in names():
        hint = close_match(name, names())
        raise ExchangeError(f"unknown layout {name!r}.{hint} Known: {', '.join(names())}.")
    module = import_module(f"trackmark.bench.exchange.formats.{name.replace('-', '_')}")
    selected: Layout = module.LAYOUT
    return selected


def is_layout_of(name: str, folder: Path) -> bool:
    """Return whether a tracker's folder of results has a layout, judged by its first file."""
    form = layout(name)
    return bool(form.fits and (files := form.files(folder)) and form.fits(files[min(files)][0]))


def sniffed(folder: Path) -> str:
    """Return the name of the layout of a tracker's folder; raise `ExchangeError` if none fits."""
    if not folder.is_dir():
        raise ExchangeError(f"{folder} is no folder with a tracker's results.")
    for name in names():
        if is_layout_of(name, folder):
            return name
    content = ", ".join(sorted(path.name for path in folder.iterdir())[:3])
    wanted = "; ".join(f"{layout(name).expects} ({name})" for name in names())
    raise ExchangeError(
        f"{folder}: these are no results of a layout that is read. Looked for: {wanted}. "
        f"There is {content or 'nothing'}."
    )
