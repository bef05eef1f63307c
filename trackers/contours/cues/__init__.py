"""Cues that depend on one another: a chain of modules, each of which yields weighted hypotheses."""
