"""Entry point of `python -m trackmark`."""

from trackmark.bench.command_line import main

if __name__ == "__main__":  # not in worker processes, which import this module under another name
    main()
