"""Nguyen and Smeulders 2002: template of per-pixel Kalman filters on colour invariants."""
