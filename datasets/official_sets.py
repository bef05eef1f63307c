"""Names and counts of the sequences in published datasets, to check whether a copy is complete."""

from collections.abc import Iterable
from dataclasses import dataclass

_MAX_LISTED = 10  # maximum number of missing or unknown sequences that a text names

_OTB_50 = """
    Basketball Biker Bird1 BlurBody BlurCar2 BlurFace BlurOwl Bolt Box Car1 Car4 CarDark CarScale
    ClifBar Couple Crowds David Deer Diving DragonBaby Dudek Football Freeman4 Girl Human3 Human4
    Human6 Human9 Ironman Jump Jumping Liquor Matrix MotorRolling Panda RedTeam Shaking Singer2
    Skating1 Skating2.1 Skating2.2 Skiing Soccer Surfer Sylvester Tiger2 Trellis Walking Walking2
    Woman
"""
_OTB_OTHERS = """
    Bird2 BlurCar1 BlurCar3 BlurCar4 Board Bolt2 Boy Car2 Car24 Coke Coupon Crossing Dancer Dancer2
    David2 David3 Dog Dog1 Doll FaceOcc1 FaceOcc2 Fish FleetFace Football1 Freeman1 Freeman3 Girl2
    Gym Human2 Human5 Human7 Human8 Jogging.1 Jogging.2 KiteSurf Lemming Man Mhyang MountainBike
    Rubik Singer1 Skater Skater2 Subway Suv Tiger1 Toy Trans Twinnings Vase
"""


@dataclass(frozen=True)
class OfficialSet:
    """Published set of sequences, such as a benchmark or its test set."""

    name: str
    reader: str  # module of `datasets.readers`
    size: int  # number of sequences
    names: frozenset[str] = frozenset()  # names of the sequences; empty if unknown


def _got10k(name: str, size: int) -> OfficialSet:
    names = frozenset(f"GOT-10k_{name.title()}_{number:06}" for number in range(1, size + 1))
    return OfficialSet(f"GOT-10k {name}", "got10k", size, names)


# Sources: Wu, Lim, Yang, IEEE TPAMI 2015, with the names in the GOT-10k toolkit; Huang, Zhao,
# Huang, IEEE TPAMI 2021; Fan et al., CVPR 2019 and IJCV 2021; Müller et al., ECCV 2018; Müller,
# Smith, Ghanem, ECCV 2016; Kiani Galoogahi et al., ICCV 2017.
SETS = (
    OfficialSet("OTB-50", "otb", 50, frozenset(_OTB_50.split())),
    OfficialSet("OTB-100", "otb", 100, frozenset((_OTB_50 + _OTB_OTHERS).split())),
    _got10k("val", 180),
    _got10k("test", 180),
    OfficialSet("LaSOT extension", "lasot", 150),
    OfficialSet("LaSOT test", "lasot", 280),
    OfficialSet("LaSOT train", "lasot", 1120),
    OfficialSet("LaSOT", "lasot", 1400),
    OfficialSet("TrackingNet test", "trackingnet", 511),
    OfficialSet("UAV123", "uav123", 123),
    OfficialSet("NfS", "nfs", 100),
)


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


def compare(reader: str, names: Iterable[str]) -> list[Coverage]:
    """Compare the sequences of a folder with the official sets of a reader.

    Sets that lack a quarter of the folder's sequences or more are omitted. Of the other sets, those
    with the fewest unknown sequences are compared, and only complete ones if there are any.
    """
    present = set(names)
    coverages: dict[int, list[Coverage]] = {}  # by number of unknown sequences
    for official in SETS:
        members = present & official.names if official.names else present
        unknown = tuple(sorted(present - members))
        n_unknown = len(unknown) or max(0, len(members) - official.size)
        if official.reader == reader and 4 * n_unknown < len(present):
            missing = tuple(sorted(official.names - present))
            coverage = Coverage(official, len(members), missing, unknown)
            coverages.setdefault(n_unknown, []).append(coverage)
    closest = coverages[min(coverages)] if coverages else []
    complete = [entry for entry in closest if entry.size == entry.official.size]
    return complete or closest
