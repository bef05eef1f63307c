"""What is left of an experiment, how long that will take, and doing it."""
