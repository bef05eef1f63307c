"""Sequence `wang2010/hand`: a hand moves in front of a face in an office."""
