"""Maps over the image that a window is moved on: back-projection, colour and motion."""
