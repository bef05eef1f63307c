"""Engines: where units of work are performed, and what keeps a bad tracker from harming others."""
