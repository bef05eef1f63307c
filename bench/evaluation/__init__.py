"""The only loop over frames, what records a run in it, and passes that measure time."""
