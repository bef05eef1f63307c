"""One file a command: `<name>.py` defines the click command `command`."""

EXIT_ANSWER_IS_NO = 1
EXIT_WRONG_INPUT = 2
EXIT_INTERRUPTED = 130
