"""What is asked for: experiment files, and trackers with settled parameters and a version."""
