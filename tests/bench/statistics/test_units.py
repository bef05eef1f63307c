"""Grouping of sequences into families or scenes, and means of units."""

import numpy as np
import pytest

from trackmark.bench.statistics.units import units_of

TWO_FAMILIES = ["cup:scene=1", "cup:scene=2", "cup:scene=2:light=even", "box"]


def test_units_are_families_if_there_are_several():
    units = units_of(TWO_FAMILIES)
    assert (units.kind, units.labels, units.plural) == ("family", ["cup", "box"], "families")
    assert units.means([[0.1, 0.2, 0.3, 0.8]]).tolist() == [[pytest.approx(0.2), 0.8]]


def test_units_are_scenes_of_a_single_family_and_on_request():
    assert units_of(TWO_FAMILIES[:3]).labels == ["cup:scene=1", "cup:scene=2"]
    units = units_of(TWO_FAMILIES, "scene")
    assert (units.kind, len(units), units.families) == ("scene", 3, 2)
    assert units.scope == "for new scenes of these 2 families only"
    np.testing.assert_allclose(units.means([0.1, 0.2, 0.3, 0.8]), [0.1, 0.25, 0.8])


def test_units_of_recorded_sequences_are_sequences():
    units = units_of(["samples/box", "samples/cup"])
    assert (units.kind, units.scope) == ("sequence", "for new sequences")
    assert units_of(["box"]).kind == "sequence"
