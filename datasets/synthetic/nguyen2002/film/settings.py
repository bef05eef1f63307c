"""Settings of the film: where a clip plays, what is tracked there, what passes before it."""

from dataclasses import dataclass

from datasets.synthetic.nguyen2002.film import backdrops, furniture, grounds
from datasets.synthetic.nguyen2002.film.place import Scenery, Standing
from datasets.synthetic.render.street.car import car
from datasets.synthetic.render.street.facades import backdrop
from datasets.synthetic.render.street.furniture import bush, litter_bin, post, sign, tree

__all__ = ["SETTINGS", "Setting"]


@dataclass(frozen=True)
class Setting:
    """A setting.

    Attributes
    ----------
    scenery : Scenery
    targets : tuple of str
        Names of `targets.KINDS`: round ones and others.
    hiders : tuple of str
        Names of `hiders.HIDERS` that hide all of a target.
    """

    scenery: Scenery
    targets: tuple[str, ...]
    hiders: tuple[str, ...]


BEHIND = 19.0, 30.0
"""Where things stand that a target passes before [metres]."""

SETTINGS = {
    "street": Setting(
        Scenery(backdrop, 33.0, grounds.road, (
            Standing(tree, 9.0, BEHIND), Standing(car, 11.0, (22.0, 27.0)),
            Standing(post, 14.0, BEHIND), Standing(sign, 12.0, BEHIND),
            Standing(litter_bin, 15.0, BEHIND))),
        ("van", "board", "helmet", "sign", "spare wheel"),
        ("pillar", "lorry", "bus", "passer-by", "trunk", "wall end"),
    ),
    "quay": Setting(
        Scenery(backdrops.harbour, 36.0, grounds.quay, (
            Standing(furniture.goods, 6.0, BEHIND), Standing(furniture.bollard, 6.0, BEHIND),
            Standing(post, 16.0, BEHIND))),
        ("crate", "drum", "van", "barrel", "fender", "sign"),
        ("container", "load", "lorry", "pillar", "passer-by"),
    ),
    "basin": Setting(
        Scenery(backdrops.roadstead, 60.0, grounds.water, (
            Standing(furniture.boat, 9.0, (22.0, 45.0)), Standing(furniture.bollard, 7.0, BEHIND))),
        ("boat", "buoy"),
        ("ship", "pillar", "wall end", "load"),
    ),
    "station": Setting(
        Scenery(backdrops.station, 31.0, grounds.platform, (
            Standing(furniture.column, 6.5, (19.0, 24.0)),
            Standing(furniture.trolley, 7.0, (18.0, 24.0)))),
        ("case", "crate", "board", "clock", "barrel"),
        ("pillar", "passer-by", "wall end", "lorry"),
    ),
    "market": Setting(
        Scenery(backdrop, 34.0, grounds.market_place, (
            Standing(furniture.stall, 4.5, (21.0, 30.0)), Standing(furniture.goods, 8.0, BEHIND),
            Standing(tree, 18.0, BEHIND))),
        ("crate", "drum", "lantern", "barrel", "sign"),
        ("passer-by", "pillar", "trunk", "wall end", "lorry"),
    ),
    "desert": Setting(
        Scenery(backdrops.desert, 120.0, grounds.sand, (
            Standing(bush, 5.0, (18.0, 60.0)), Standing(furniture.rock, 6.0, (18.0, 60.0)),
            Standing(post, 16.0, (24.0, 25.0)))),
        ("van", "drum", "board", "helmet", "spare wheel", "sign"),
        ("lorry", "trunk", "wall end", "container"),
    ),
}  # fmt: skip
"""By name."""
