"""Tracker that speaks TraX by hand: returns the init box. Usage: plain.py VERSION [MODE].

Frame 3 shows the mode: it raises, exits, hangs, … It needs the standard library only.
"""

import os
import re
import sys
import time


def write(text):
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def hang():
    """Mark that this process hangs."""
    with open(os.environ["HANGS"], "w"):  # noqa: PTH123
        pass
    time.sleep(9999)


def main():
    version, mode = int(sys.argv[1]), (sys.argv[2:] or [""])[0]
    if mode == "no start":
        sys.exit("no licence")
    if mode == "slow start":
        write("loading weights")
        hang()
    extra = ' "trax.channels=depth"' if mode == "depth" else ""
    image = "url" if mode == "url" else "path"
    write("a banner")
    hello = (
        f'"trax.version={version}" "trax.name=plain" "trax.image={image};" "trax.region=rectangle;"'
    )
    write(f"@@TRAX:hello {hello}{extra}")
    answer, frame, region = "state" if version > 1 else "status", 0, ""
    for line in sys.stdin:
        if line.startswith("@@TRAX:quit"):
            break
        arguments = re.findall('"([^"]*)"', line)
        if line.startswith("@@TRAX:initialize"):
            region, frame = arguments[version < 4], 0
            if version == 4:
                continue  # the image follows in a message `frame`
        if mode == "properties":
            sys.stderr.write(line)
        with open(arguments[0].removeprefix("file://"), "rb") as file:  # noqa: PTH123
            assert file.read(2) == b"BM"
        if frame == 3:
            if mode == "exit":
                os._exit(7)
            if mode == "signal":
                os.abort()
            if mode == "hang":
                hang()
            if mode == "garbage":
                region = "nonsense,1"
            if mode == "nan":
                region = "nan,1,2,3"
            if mode == "quit":
                write('@@TRAX:quit "trax.reason=out of \\"memory\\""')
            if mode == "special":
                region = "0"
            if mode == "hello":
                write("@@TRAX:hello")
        confidence = "7" if mode == "confidence" else "0.5"
        write(f'a log line\n@@TRAX:{answer} "{region}" "confidence={confidence}"')
        frame += 1


if __name__ == "__main__":
    main()
