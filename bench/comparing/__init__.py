"""Comparing trackers on the same sequences: what stored runs say of which is better."""

from bench.reporting import MARGINS

__all__ = ["MARGINS"]
