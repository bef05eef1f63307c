"""Comparing trackers on the same sequences: what stored runs say of which is better."""
