"""Planning, time estimates and execution of experiments."""
