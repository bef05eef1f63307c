"""What the maps of colour mark: closed forms on painted squares."""

import numpy as np
import pytest

from bench.papers.wang2010.checks import contrast, gating, illumination
from datasets import Sequence

GREEN, PALE_GREEN, WHITE, GREY = (0, 160, 0), (80, 160, 80), (255, 255, 255), (128, 128, 128)
SIDE = 20


def square(x, y=50, side=SIDE):
    mask = np.zeros((120, 160), bool)
    mask[y : y + side, x : x + side] = True
    return mask


def painted(*things):
    image = np.full((120, 160, 3), GREY, np.uint8)
    for mask, colour in things:
        image[mask] = colour
    return image


def sequence(images, masks, **more):
    boxes = [[columns.min(), rows.min(), SIDE, SIDE] for rows, columns in map(np.nonzero, masks)]
    return Sequence(
        "painted",
        images,
        np.array(boxes, float),
        fingerprint="p",
        masks=lambda frame: masks[frame],
        **more,
    )


def test_saturation_sets_a_target_off_from_pale_surroundings_of_its_hue():
    mask, around = square(50), square(30, 30, 60)
    pale = painted((around, PALE_GREEN), (mask, GREEN))
    plain = painted((mask, GREEN))
    on_pale = np.array([False, True, False])
    shown = sequence([plain, pale, plain], [mask] * 3, attributes={"similar background": on_pale})
    rows = contrast.measure(shown, quick=False)["wa-2"].set_index(["frame", "map"])
    assert rows.loc[(1, "hue"), "contrast"] == 0.0
    both = rows.loc[(1, "hue and saturation")]
    assert both["inside"] == pytest.approx(1.0)
    assert both["outside"] == pytest.approx(0.7)
    assert both["difference"] == pytest.approx(0.3)
    assert both["contrast"] == pytest.approx(0.3 / 1.7)
    assert rows["similar"].tolist() == [1.0, 1.0, 0.0, 0.0]
    assert rows.loc[2, "contrast"].tolist() == [1.0, 1.0]


def test_surroundings_are_as_wide_as_the_target_to_every_side():
    mask = square(50)
    around = contrast.surroundings(np.array([50.0, 50.0, 20.0, 20.0]), mask)
    assert (around == (square(30, 30, 60) & ~mask)).all()


def test_a_target_that_is_hidden_makes_no_row():
    mask, hidden = square(50), np.zeros((120, 160), bool)
    boxes = np.tile([50.0, 50.0, 20.0, 20.0], (3, 1))
    masks = [mask, hidden, mask]
    images = [painted((mask, GREEN)), painted(), painted((mask, GREEN))]
    shown = Sequence("hidden", images, boxes, fingerprint="h", masks=lambda frame: masks[frame])
    assert contrast.measure(shown, quick=False)["wa-2"]["frame"].unique().tolist() == [2]
    assert 1 not in illumination.measure(shown, quick=False)["wa-3"]["frame"].to_numpy()


def test_hue_and_saturation_of_a_pure_colour_outlast_a_gain_and_its_value_does_not():
    mask = square(50)
    shown = sequence([painted((mask, GREEN))] * 3, [mask] * 3)
    rows = illumination.measure(shown, quick=False)["wa-3"]
    assert sorted(rows["gain"].unique()) == [0.5, 0.75, 1.25, 1.5]
    by_map = rows.groupby("map")
    assert (by_map.get_group("without value")["change"] == 0.0).all()
    assert by_map.get_group("with value")["change"].to_numpy() == pytest.approx(0.15)
    assert by_map.get_group("with value")["inside"].to_numpy() == pytest.approx(0.85)


def test_what_moves_in_the_targets_colours_is_the_target_alone():
    masks = [square(10 + 4 * frame) for frame in range(14)]
    others = [square(120 - 4 * frame, 5) for frame in range(14)]
    poster = square(130, 90)
    images = [
        painted((poster, GREEN), (other, WHITE), (mask, GREEN))
        for mask, other in zip(masks, others, strict=True)
    ]
    rows = gating.measure(sequence(images, masks), quick=False)["wa-7"]
    by_map = {name: part.set_index("frame") for name, part in rows.groupby("map")}
    assert (by_map["colour"]["inside"] == 0.5).all()  # a poster of its colour and size
    assert (by_map["colour"]["covered"] == 1.0).all()
    assert (by_map["colour and moving"]["inside"] == 1.0).all()
    assert (by_map["moving"]["inside"] < 0.5).all()  # something white moves, too
    assert by_map["colour and moving"]["covered"].equals(by_map["moving"]["covered"])
    assert rows.loc[rows["figure"] == 1, "frame"].unique().tolist() == [10, 11]


def test_a_map_without_anything_has_no_share():
    mask = square(50)
    rows = gating.measure(sequence([painted((mask, GREEN))] * 4, [mask] * 4), quick=False)["wa-7"]
    by_map = rows.groupby("map")["inside"]
    assert by_map.get_group("moving").isna().all()
    assert by_map.get_group("colour").tolist() == [1.0, 1.0]
