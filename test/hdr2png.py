#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Radiance pictures side by side as one PNG, all at the same exposure.

usage: hdr2png.py [-s N] [-e EXPOSURE] OUT.png PICTURE[=CAPTION]...
  -s N  average N x N pixels into one    -e  factor on the radiance (default: from the first picture)
"""
import argparse
import sys

import numpy as np
from PIL import Image, ImageDraw, ImageFont


def read_hdr(path):
    """RGBE picture in scan line order -Y +X, run-length encoded or flat; radiance as float array."""
    with open(path, "rb") as file:
        data = file.read()
    if not data.startswith(b"#?"):
        sys.exit(f"hdr2png: {path}: not a Radiance picture")
    head, _, data = data.partition(b"\n\n")
    exposure = np.prod([float(line[9:]) for line in head.split(b"\n") if line.startswith(b"EXPOSURE=")])
    size, _, data = data.partition(b"\n")
    words = size.split()
    if words[0] != b"-Y" or words[2] != b"+X":
        sys.exit(f"hdr2png: {path}: orientation {size.decode()} is not supported")
    height, width = int(words[1]), int(words[3])
    rgbe = np.zeros((height, width, 4), np.uint8)
    data = np.frombuffer(data, np.uint8)
    at = 0
    for y in range(height):
        if data[at] != 2 or data[at + 1] != 2:  # flat
            rgbe[y] = data[at:at + 4 * width].reshape(width, 4)
            at += 4 * width
            continue
        at += 4
        for channel in range(4):
            x = 0
            while x < width:
                count = int(data[at])
                if count > 128:
                    rgbe[y, x:x + count - 128, channel] = data[at + 1]
                    x += count - 128
                    at += 2
                else:
                    rgbe[y, x:x + count, channel] = data[at + 1:at + 1 + count]
                    x += count
                    at += 1 + count
    scale = np.where(rgbe[..., 3:] > 0, np.exp2(rgbe[..., 3:].astype(float) - 136), 0)
    return (rgbe[..., :3] + .5) * scale / exposure


def average(picture, n):
    height, width = picture.shape[0] // n, picture.shape[1] // n
    return picture[:height * n, :width * n].reshape(height, n, width, n, 3).mean((1, 3))


def tone(picture):
    """Extended Reinhard curve on luminance (Reinhard et al., SIGGRAPH 2002, eq. 4), then the sRGB transfer curve."""
    white = 4.0
    luminance = np.maximum(picture @ [.265, .670, .065], 1e-9)[..., None]
    picture = np.clip(picture * (1 + luminance / white**2) / (1 + luminance), 0, 1)
    return np.where(picture <= .0031308, 12.92 * picture, 1.055 * picture**(1 / 2.4) - .055)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("-s", type=int, default=1)
    parser.add_argument("-e", type=float)
    parser.add_argument("out")
    parser.add_argument("pictures", nargs="+")
    args = parser.parse_args()
    panels = []
    exposure = args.e
    for argument in args.pictures:
        path, _, caption = argument.partition("=")
        picture = read_hdr(path)
        if exposure is None:
            luminance = picture @ [.265, .670, .065]
            exposure = .45 / np.exp(np.log(luminance[luminance > 0]).mean())
        # limited before averaging, so that one bright pixel does not leave a jagged edge
        picture = average(np.minimum(picture * exposure, 8), args.s)
        panel = Image.fromarray((tone(picture) * 255 + .5).astype(np.uint8))
        if caption:
            font = ImageFont.load_default(max(12, panel.width // 34))
            draw = ImageDraw.Draw(panel, "RGBA")
            box = draw.textbbox((12, 10), caption, font=font)
            draw.rectangle((box[0] - 6, box[1] - 5, box[2] + 6, box[3] + 5), fill=(0, 0, 0, 150))
            draw.text((12, 10), caption, fill=(255, 255, 255), font=font)
        panels.append(panel)
    gap = 6
    out = Image.new("RGB", (sum(p.width for p in panels) + gap * (len(panels) - 1), max(p.height for p in panels)), "white")
    x = 0
    for panel in panels:
        out.paste(panel, (x, 0))
        x += panel.width + gap
    out.save(args.out, optimize=True)


main()
