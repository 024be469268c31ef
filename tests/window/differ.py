#!/usr/bin/env python3
"""Fails where two pictures of one size differ in too few pixels.

    differ.py PICTURE PICTURE PERCENT

Pixels differ where a channel does by more than 20 of 255. It needs Pillow.
"""
import sys

from PIL import Image, ImageChops


def main():
    first, second = (Image.open(path).convert("RGB") for path in sys.argv[1:3])
    least_percent = float(sys.argv[3])
    if first.size != second.size:
        sys.exit(f"expected pictures of one size, found {first.size} and {second.size}")
    largest = ImageChops.difference(first, second).split()
    largest = ImageChops.lighter(ImageChops.lighter(largest[0], largest[1]), largest[2])
    differing = sum(largest.histogram()[21:])
    percent = 100 * differing / (first.size[0] * first.size[1])
    print(f"{percent:.1f} % of the pixels differ")
    if percent < least_percent:
        sys.exit(f"expected {least_percent} % of the pixels to differ, found {percent:.1f} %")


if __name__ == "__main__":
    main()
