"""Start `worker.py`, if Python is new enough; this file therefore has the syntax of Python 2.

Usage: python start.py WORKER ARGUMENTS, where WORKER is the path of `worker.py`.
"""

import runpy
import sys

if __name__ == "__main__":
    if sys.version_info < (3, 6):
        version = "%d.%d" % sys.version_info[:2]
        sys.exit(
            "%s is Python %s. Expected: Python 3.6 or newer. Select it with python=PATH."
            % (sys.executable, version)
        )
    sys.argv.pop(0)
    runpy.run_path(sys.argv[0], run_name="__main__")
