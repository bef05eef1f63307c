"""Comparisons of trackers on stored runs: better or worse, breaking points, regressions."""
