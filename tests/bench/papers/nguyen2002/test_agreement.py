"""What the comparison of implementations finds where they differ, and where they don't."""

import pytest

import trackers
from bench.papers.nguyen2002 import agreement
from bench.papers.nguyen2002.agreement import differences


@pytest.fixture(autouse=True)
def small(monkeypatch):
    """A small clip, through whose occlusion a tracker looks for 19 frames at most."""
    monkeypatch.setattr(agreement, "CLIP", "plain/target:length=60:occlusion=1")
    monkeypatch.setattr(agreement, "QUICK", slice(12, 56))
    monkeypatch.setattr(agreement, "PRESETS", ("as-written:longest_occlusion=19",))


def test_equal_implementations_differ_by_rounding_alone():
    (way,) = differences(quick=True).to_dict("records")
    assert way["features"] == "rgb"
    assert max(way["online"], way["revised"], way["offline"]) < 1e-9
    assert (way["sooner"], way["same_events"]) == (0.0, 1.0)


def test_what_differs_is_told(monkeypatch):
    plain, create, offline = agreement.PlainNguyen2002, trackers.create, agreement.track_offline
    monkeypatch.setattr(
        agreement, "PlainNguyen2002", lambda **given: plain(**given | {"gamma": 0.4})
    )
    monkeypatch.setattr(
        trackers, "create", lambda name, **given: create(name, **given | {"report": "raw"})
    )
    monkeypatch.setattr(
        agreement,
        "track_offline",
        lambda *seen, **given: offline(*seen, **given | {"first_spread": 1.0}),
    )
    (way,) = differences(quick=True).to_dict("records")
    for name in ("online", "revised", "offline", "sooner"):
        assert way[name] > 1e-3, name
    assert way["same_events"] == 0.0
