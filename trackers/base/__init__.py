"""Interface of trackers, and code that all families of trackers use."""
