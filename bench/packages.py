"""Whether the packages `datasets`, `trackers` and `reports` are really trackmark's own.

Other distributions install packages of the same names. With one of those in the way an
import would fail far from the cause, or quietly mix two projects.
"""

import sys
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from importlib.metadata import Distribution

NAMES = ("bench", "datasets", "reports", "trackers")
DISTRIBUTION = "trackmark"
ADVICE = "Give trackmark an environment of its own: `make setup` in a fresh clone makes one."


class NameClashError(ImportError):
    """Another distribution's package stands where trackmark's should."""


def check_place() -> None:
    """Check that the other packages lie beside this one.

    Raises `NameClashError` naming the package that would be imported instead, and what to do.
    """
    home = Path(__file__).resolve().parents[1]
    for name in NAMES[1:]:
        loaded = sys.modules.get(name)
        spec = loaded.__spec__ if loaded is not None else find_spec(name)
        origin = getattr(spec, "origin", None)
        if origin is None or Path(origin).resolve().parents[1] != home:
            raise NameClashError(
                f"the package {name!r} would come from {origin or 'nowhere'}, not from {home}. "
                + ADVICE
            )


def check_ownership() -> None:
    """Check that no other installed distribution claims one of the names.

    This sees what `check_place` can't: two distributions written into one folder.

    Raises `NameClashError` naming the distributions.
    """
    from importlib.metadata import distributions  # takes as long as all else that help needs

    for distribution in distributions():
        for claimed in NAMES:
            if _claims(distribution, claimed) and distribution.metadata["Name"] != DISTRIBUTION:
                raise NameClashError(
                    f"the distribution {distribution.metadata['Name']!r} also installs a package "
                    f"{claimed!r} here. {ADVICE}"
                )


def _claims(distribution: "Distribution", package: str) -> bool:
    file = f"{package}/__init__.py"
    if not Path(str(distribution.locate_file(file))).is_file():
        return False
    return any(str(own) == file for own in distribution.files or ())
