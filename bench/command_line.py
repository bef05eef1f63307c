"""Entry point of the command `trackmark`."""

import signal


def main() -> None:
    """Run the command line and exit.

    The imports of the command line take so long that users interrupt them. Python would then print
    a traceback. Therefore Ctrl-C ends the process directly until `cli.main` handles it.
    """
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # not ignored, as by nohup
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from trackmark.bench import cli

    cli.main()
