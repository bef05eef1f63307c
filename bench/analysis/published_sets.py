"""Published scores that are part of trackmark."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

FOLDER = Path(__file__).with_name("published")


@dataclass(frozen=True)
class PublishedSet:
    """Published scores of many trackers on the sequences of a benchmark.

    Attributes
    ----------
    name : str
        Value of `--published`; the scores are in the file `published/<name>.csv`.
    summary : str
        Content in a few words.
    metrics, measure : str
        Metrics and score that define the numbers in the same way as the source.
    source, citation : str
        Origin of the numbers; publication to cite.
    aliases : mapping of str to tuple of str
        Names that copies of the benchmark give to a sequence, by its name in the file.
    """

    name: str
    summary: str
    metrics: str
    measure: str
    source: str
    citation: str
    aliases: Mapping[str, tuple[str, ...]]

    @property
    def file(self) -> Path:
        """CSV file with the columns `tracker`, `sequence` and the measure."""
        return FOLDER / f"{self.name}.csv"


SETS = {
    published.name: published
    for published in (
        PublishedSet(
            name="otb100",
            summary="mean overlap of 34 trackers on the 100 sequences of OTB",
            metrics="otb",
            measure="mean_overlap",
            source="score files `tb100` of jwlim/tracker_benchmark, commit 5e1029c",
            citation="Wu, Lim, Yang, Object tracking benchmark, IEEE TPAMI 37(9), 2015",
            aliases={
                "BasketBall": ("Basketball",),
                "Human4-2": ("Human4", "Human4.2", "Human4_2"),
                "Jogging-1": ("Jogging", "Jogging.1", "Jogging_1"),
                "Jogging-2": ("Jogging.2", "Jogging_2"),
                "Skating2-1": ("Skating2", "Skating2.1", "Skating2_1"),
                "Skating2-2": ("Skating2.2", "Skating2_2"),
            },
        ),
    )
}
"""Published scores that are part of trackmark, by name."""
