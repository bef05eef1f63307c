"""What is asked for: experiment files, trackers with settled parameters, the plan and its cost."""
