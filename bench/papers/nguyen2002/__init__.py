"""A template of per-pixel Kalman filters on colour invariants: its Table 1, Fig. 1, and claims."""
