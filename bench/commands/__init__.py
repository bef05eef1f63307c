"""Commands of the command line: each `<name>.py` defines the click command `command`."""

EXIT_NEGATIVE = 1
EXIT_WRONG_INPUT = 2
EXIT_INTERRUPTED = 130
