"""Confidence intervals, and rules of decisions and verdicts."""
