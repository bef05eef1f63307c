"""Names and counts of the sequences in published datasets, to check whether a copy is complete."""

from collections.abc import Iterable
from dataclasses import dataclass

from trackmark.datasets.layouts import OfficialSet, layouts

_MAX_LISTED = 10  # maximum number of missing or unknown sequences that a text names


@dataclass(frozen=True)
class Coverage:
    """Comparison of a folder with an official set; without known names, the lists are empty."""

    official: OfficialSet
    size: int  # sequences of the set in the folder; all in the folder if names are unknown
    missing: tuple[str, ...]  # names of the set that the folder lacks
    unknown: tuple[str, ...]  # names in the folder that the set does not have

    def __str__(self) -> str:
        """Return the comparison in one line."""
        name, size = self.official.name, self.official.size
        comparison = f"complete, {size}" if self.size == size else f"{self.size} of {size}"
        comparison = f"{name}: {comparison} sequences"
        for word, names in (("missing", self.missing), ("unknown", self.unknown)):
            n_more = len(names) - _MAX_LISTED
            more = f" and {n_more} more" if n_more > 0 else ""
            comparison += f", {word}: {', '.join(names[:_MAX_LISTED])}{more}" if names else ""
        return comparison


def compare(layout: str, names: Iterable[str]) -> list[Coverage]:
    """Compare the sequences of a folder with the official sets of a layout.

    Sets that lack a quarter of the folder's sequences or more are omitted. Of the other sets, those
    with the fewest unknown sequences are compared, and only complete ones if there are any.
    """
    present = set(names)
    coverages: dict[int, list[Coverage]] = {}  # by number of unknown sequences
    for official in layouts()[layout].sets:
        official_names = official.sequence_names()
        members = present & official_names if official_names else present
        unknown = tuple(sorted(present - members))
        n_unknown = len(unknown) or max(0, len(members) - official.size)
        if 4 * n_unknown < len(present):
            missing = tuple(sorted(official_names - present))
            coverage = Coverage(official, len(members), missing, unknown)
            coverages.setdefault(n_unknown, []).append(coverage)
    closest = coverages[min(coverages)] if coverages else []
    complete = [entry for entry in closest if entry.size == entry.official.size]
    return complete or closest
