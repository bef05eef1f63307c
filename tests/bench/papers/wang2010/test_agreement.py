"""The two implementations of the methods side by side."""

from bench.papers.wang2010 import agreement
from bench.papers.wang2010.agreement import greatest_differences
from bench.papers.wang2010.costs import METHODS

TARGET = "plain/target:length=30"


def test_every_method_is_compared_with_its_plain_twin_on_equal_random_numbers():
    found = greatest_differences([TARGET], frames=6)
    assert found["method"].tolist() == list(METHODS)
    assert set(found["sequence"]) == {TARGET}
    assert found["difference"].max() <= 1e-9


def test_a_method_that_differs_is_told_by_how_far(monkeypatch):
    def other(method, kind):
        return real(method, kind, difference_window=1 if kind == "plain" else 5)

    real = agreement.make
    monkeypatch.setattr(agreement, "make", other)
    monkeypatch.setattr(agreement, "METHODS", ["camshift_improved"])
    (difference,) = greatest_differences([TARGET], frames=6)["difference"]
    assert difference > 1e-6
