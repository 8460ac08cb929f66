#!/usr/bin/env python3
"""Makes a moving picture (GIF) of a walk through a model, with frames by `biplane render`.

    make_moving_picture.py MODEL PICTURE.gif [--frames N] [--width PIXELS] [--most-bytes N]

MODEL is a folder that `biplane build` wrote. Each frame shows the raw mesh beside the model, from a place on
the robot's way. All frames share one table of colors, so that flat walls stay flat. Fails when the file is
larger than --most-bytes. With `biplane` on PATH, and Pillow."""

import argparse
import sys
import tempfile
from pathlib import Path

from PIL import Image

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.programs import run
from lib.verdict import require

COLORS = 48
FRAME_MS = 130


def frame(model, at_percent, width, folder):
    """One picture by the software renderer, from where the robot was."""
    path = Path(folder) / f"{at_percent:.2f}.png"
    size = ["--width", width, "--height", round(0.4 * width)]
    run("biplane", "render", model, "-o", path, "--view", "inside", "--at", f"{at_percent:.2f}", *size)
    return Image.open(path).convert("RGB")


def main(args):
    span = args.to_percent - args.from_percent
    places = [args.from_percent + span * k / args.frames for k in range(args.frames)]
    with tempfile.TemporaryDirectory() as folder:
        frames = [frame(args.model, at, args.width, folder) for at in places]
    # The table of colors is that of all frames together.
    sheet = Image.new("RGB", (frames[0].width, frames[0].height * len(frames)))
    for k, each in enumerate(frames):
        sheet.paste(each, (0, k * each.height))
    table = sheet.quantize(COLORS, method=Image.Quantize.MEDIANCUT)
    drawn = [each.quantize(palette=table, dither=Image.Dither.NONE) for each in frames]
    options = {"duration": FRAME_MS, "loop": 0, "optimize": False}
    drawn[0].save(args.picture, save_all=True, append_images=drawn[1:], **options)
    size = Path(args.picture).stat().st_size
    print(f"{args.picture}: {len(drawn)} frames, {size} bytes")
    require(size <= args.most_bytes, f"{size} bytes, {args.most_bytes} allowed")


words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
words.add_argument("model")
words.add_argument("picture")
words.add_argument("--frames", type=int, default=40)
words.add_argument("--width", type=int, default=640)
words.add_argument("--from-percent", type=float, default=0.0)
words.add_argument("--to-percent", type=float, default=100.0)
words.add_argument("--most-bytes", type=int, default=1_500_000)
main(words.parse_args())
