"""What every tracker stands on: the interface, its parameters, and shared work on a frame."""
