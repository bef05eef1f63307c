"""The two implementations of the methods side by side."""

import pytest

import trackers
from bench.papers.wang2010 import agreement
from bench.papers.wang2010.agreement import SETTINGS, greatest_differences
from bench.papers.wang2010.costs import METHODS
from bench.papers.wang2010.courses import CUP, HAND, TABLE_TENNIS

TARGET = "plain/target:length=30"
ENOUGH = 1e-9  # pixels


def test_every_setting_is_compared_with_its_plain_twin_on_equal_random_numbers():
    found = greatest_differences([TABLE_TENNIS, HAND, CUP], frames=5)
    assert found["setting"].tolist() == 3 * list(SETTINGS)
    assert found["difference"].max() <= ENOUGH, found.nlargest(3, "difference")


@pytest.mark.slow
@pytest.mark.parametrize("sequence", [TABLE_TENNIS, HAND, CUP])
@pytest.mark.parametrize("scene", [0, 7, 13])
def test_compiled_equals_plain_over_whole_sequences(sequence, scene):
    found = greatest_differences([f"{sequence}:scene={scene}"])
    assert found["difference"].max() <= ENOUGH, found.nlargest(3, "difference")


@pytest.mark.parametrize("preset", ["recommended", "robust"])
def test_settings_that_are_called_so_are_those_of_the_presets(preset):
    chosen = [settings for name, settings in SETTINGS.items() if name.endswith(preset)]
    assert len(chosen) >= 2
    for method, options in chosen:
        name = METHODS[method][0]
        written = trackers.create(name, 0, preset="as-written", **options)
        assert written.parameters == trackers.create(name, 0, preset=preset).parameters


def test_a_method_that_differs_is_told_by_how_far(monkeypatch):
    def other(method, kind):
        return real(method, kind, difference_window=1 if kind == "plain" else 5)

    real = agreement.make
    monkeypatch.setattr(agreement, "make", other)
    monkeypatch.setattr(agreement, "SETTINGS", {"other": ("camshift_improved", {})})
    (difference,) = greatest_differences([TARGET], frames=6)["difference"]
    assert difference > 1e-6
