"""One file a command: `<name>.py` defines the click command `command`."""
