"""Comparison of a folder with the sequences of published datasets."""

import pytest

from trackmark.datasets import official_sets
from trackmark.datasets.layouts import layouts
from trackmark.datasets.official_sets import compare

SETS = [official for layout in layouts().values() for official in layout.sets]
OTB_100 = next(entry for entry in SETS if entry.name == "OTB-100").sequence_names()


@pytest.mark.parametrize("official", SETS, ids=lambda official: official.name)
def test_official_set_has_as_many_names_as_sequences(official):
    assert len(official.sequence_names()) in {0, official.size}


def test_complete_set_is_recognised_by_names_or_number():
    assert [str(entry) for entry in compare("otb", OTB_100)] == ["OTB-100: complete, 100 sequences"]
    names = [f"dog-{number}" for number in range(280)]
    assert [str(entry) for entry in compare("lasot", names)] == [
        "LaSOT test: complete, 280 sequences"
    ]


def test_missing_sequences_are_named_or_counted():
    copy = OTB_100 - {"Vase", "Woman"}
    assert [str(entry) for entry in compare("otb", copy)] == [
        "OTB-100: 98 of 100 sequences, missing: Vase, Woman"
    ]
    names = [f"dog-{number}" for number in range(1399)]
    assert [str(entry) for entry in compare("lasot", names)] == ["LaSOT: 1399 of 1400 sequences"]


def test_names_that_a_set_does_not_have_are_listed():
    renamed = OTB_100 - {"Vase"} | {"Vase_1"}
    assert [str(entry) for entry in compare("otb", renamed)] == [
        "OTB-100: 99 of 100 sequences, missing: Vase, unknown: Vase_1"
    ]
    assert [str(entry) for entry in compare("otb", OTB_100 | {"Own"})] == [
        "OTB-100: complete, 100 sequences, unknown: Own"
    ]
    names = [f"person{number}" for number in range(124)]
    assert [str(entry) for entry in compare("uav123", names)] == ["UAV123: 124 of 123 sequences"]


@pytest.mark.parametrize(("reader", "names"), [("otb", ["Own"]), ("vot", ["ball"])])
def test_folder_of_other_sequences_is_not_compared(reader, names):
    assert official_sets.compare(reader, names) == []
