"""Scores of boxes against truth: arrays in, numbers out. Truth is always the first argument."""

from collections.abc import Callable, Mapping

from bench.metrics.native import native

__all__ = ["PRESETS"]

PRESETS: Mapping[str, Callable[..., dict[str, float]]] = {"native": native}
"""Scoring function by preset name: `(truth, boxes, visible) -> scores`."""
