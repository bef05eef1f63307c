"""Nummiaro et al. 2003: adaptive colour-based particle filter with elliptic regions."""
