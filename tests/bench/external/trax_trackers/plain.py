"""Tracker that speaks TraX by hand: returns the init box. Usage: plain.py VERSION [MODE].

The mode is visible at the start or in frame 3. It needs the standard library only.
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


def misbehave(mode):
    if mode == "raise":
        raise ValueError("broken")
    if mode == "flood":
        sys.stderr.write("y" * 10_000_000)
    if mode in ("exit", "flood"):
        os._exit(7)
    if mode == "hang":
        hang()
    if mode == "quit":
        write('@@TRAX:quit "trax.reason=out of \\"memory\\""')
    if mode == "hello":
        write("@@TRAX:hello")


def main():
    version, mode = int(sys.argv[1]), (sys.argv[2:] or [""])[0]
    if mode == "no start":
        sys.exit("no licence")
    if mode == "slow":
        write("loading weights")
        hang()
    image = "url" if mode == "url" else "path"
    channels = "depth" if mode == "depth" else "color"
    write(
        f'a banner\n@@TRAX:hello "trax.version={version}" "trax.name=plain" "trax.image={image};" '
        f'"trax.region=rectangle;" "trax.channels={channels};"'
    )
    regions = {"garbage": "nonsense,1", "special": "0"}
    regions["spaces"] = '1," "2," "3," "4'
    answer, frame, region = "state" if version > 1 else "status", 0, ""
    for line in sys.stdin:
        if line.startswith("@@TRAX:quit"):
            break
        arguments = re.findall('"([^"]*)"', line)
        if line.startswith("@@TRAX:initialize"):
            region, frame = arguments[version < 4], 0
            assert mode != "properties" or '"size=2.5"' in line
            if version == 4:
                continue  # the image follows in a message `frame`
        with open(arguments[0].removeprefix("file://"), "rb") as file:  # noqa: PTH123
            assert file.read(2) == b"BM"
        if frame == 3:
            misbehave(mode)
            region = regions.get(mode, region)
        confidence = 7 if mode == "confidence" else 0.5
        message = f'@@TRAX:{answer} "{region}" "confidence={confidence}"'
        surplus = {"twice": frame == 3, "later": frame == 4, "last": frame == 7}.get(mode)
        write(f"a log line\n{message}" + f"\n{message}" * bool(surplus))
        frame += 1


if __name__ == "__main__":
    main()
