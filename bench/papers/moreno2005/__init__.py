"""Moreno-Noguer et al. 2005: tracking with cues that depend on one another."""
