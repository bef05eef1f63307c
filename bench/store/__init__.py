"""Results on disk: runs, the truth they are scored by, what was asked for, and an index of all."""
