"""What the comparison of implementations finds where they differ, and where they don't."""

import pandas as pd
import pytest

from bench.experiments.contestant import contestant
from bench.papers.moreno2005 import agreement as module
from bench.papers.moreno2005.agreement import WAYS, agreement
from bench.papers.moreno2005.criteria import AGREEMENT

FEW = "plane_samples=4:colour_samples=10:contour_samples=20"
WRITTEN, BASELINE = "moreno2005:preset=as-written", "contour-smooth-color:preset=as-written"


@pytest.fixture(autouse=True)
def small(monkeypatch):
    """Two ways, in this process."""
    monkeypatch.setattr(module, "WAYS", {text: WAYS[text] for text in (WRITTEN, BASELINE)})
    monkeypatch.setattr(module, "QUICK_SAMPLES", FEW)
    monkeypatch.setattr(module, "QUICK_FRAMES", 1)
    monkeypatch.setattr(module, "kept_tables", one_by_one)


def one_by_one(function, identities, *where):
    return {"agreement": pd.concat([function(text)["agreement"] for text in identities])}


def test_equal_implementations_differ_by_single_precision_alone(tmp_path):
    found = agreement(tmp_path, 1, quick=True)
    assert found["tracker"].tolist() == [WRITTEN, BASELINE]
    assert found["contours"].max() <= AGREEMENT
    assert found["posteriors"].max() <= 1e-5
    assert found["weights"].max() <= 1e-5


def test_what_differs_is_told(tmp_path, monkeypatch):
    def floored(plain):
        return lambda seed, **given: plain(seed, **given | {"colour_floor": 2.0})

    for name, plain in module.PLAIN.items():
        monkeypatch.setitem(module.PLAIN, name, floored(plain))
    found = agreement(tmp_path, 1, quick=True)
    assert found["contours"].min() > AGREEMENT
    assert found[["posteriors", "weights"]].min().min() > 1e-5


def test_all_presets_of_both_are_compared():
    compared = {(one.name, one.preset) for one in map(contestant, WAYS)}
    assert {preset for name, preset in compared if name == "moreno2005"} == {
        "as-written",
        "recommended",
        "robust",
    }
    assert len(compared) == 5
