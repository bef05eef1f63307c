"""Cues that depend on one another: the paper's figures, its one-dimensional example, its claims."""
