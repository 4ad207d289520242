#!/usr/bin/env python3
"""A lumen finder in the place of probepath's own: probepath reconstruct SEQUENCE --lumen find_lumen.py

Reads images from standard input, answers one line each on standard output (docs/reconstruction.md has the protocol).
It needs nothing but Python: rays from a centre to the wall, the log undone, the edge at 0.7 of the wall's amplitude.
Simple on purpose: put a network in the place of `lumen`.
"""

import json
import math
import sys

RAYS = 48
STEP_MM = 0.1
FARTHEST_MM = 8.0


class Image:
    def __init__(self, head, pixels, decibel):
        self.columns, self.rows = head["columns"], head["rows"]
        self.x_mm, self.y_mm = head["pixel_mm"]
        self.pixels, self.amplitude = pixels, [10 ** (grey / 255 * decibel / 20) for grey in range(256)]

    def at(self, x, y):
        """Amplitude at x, y (mm): the mean of a few pixels; None outside the picture."""
        column, row = round(x / self.x_mm), round(y / self.y_mm)
        if not (2 <= column < self.columns - 2 and 2 <= row < self.rows - 2):
            return None
        places = ((0, 0), (-2, 0), (2, 0), (0, -2), (0, 2))
        return sum(self.amplitude[self.pixels[(row + v) * self.columns + column + u]] for u, v in places) / 5

    def circle(self, x, y, radius):
        """Mean amplitude on a circle."""
        turns = (2 * math.pi * k / 12 for k in range(12))
        values = [self.at(x + radius * math.cos(t), y + radius * math.sin(t)) for t in turns]
        return None if None in values else sum(values) / len(values)


def first_centre(image):
    """The place whose surroundings are bright and which itself is dark."""
    best, found = 0.0, None
    width, height = image.columns * image.x_mm, image.rows * image.y_mm
    for i in range(5, int(width) - 4):
        for j in range(5, int(height) - 4):
            inner = [image.circle(i, j, radius) for radius in (0.5, 1.5, 2.5)]
            outer = [image.circle(i, j, radius) for radius in (4.0, 4.4)]
            if None in inner or None in outer:
                continue
            contrast = max(outer) / max(inner)
            if contrast > best:
                best, found = contrast, (i, j)
    return found


def radius_along(image, x, y, turn):
    """Where the amplitude first reaches 0.7 of the wall's: the beam smears the wall into the lumen."""
    profile = []
    for k in range(int(FARTHEST_MM / STEP_MM)):
        value = image.at(x + k * STEP_MM * math.cos(turn), y + k * STEP_MM * math.sin(turn))
        if value is None:
            break
        profile.append(value)
    smooth = [sum(profile[max(0, k - 2) : k + 3]) / len(profile[max(0, k - 2) : k + 3]) for k in range(len(profile))]
    if len(smooth) < 10:
        return None
    dark = sorted(smooth)[len(smooth) // 10]
    for k in range(3, len(smooth) - 8):
        wall = max(smooth[k : k + 8])
        if smooth[k] > 0.7 * wall and wall > 6 * dark:
            return k * STEP_MM
    return None


def lumen(image, centre):
    """Columns and rows of the border, and the next centre (mm); or why there is none."""
    x, y = centre
    radii = [radius_along(image, x, y, 2 * math.pi * k / RAYS) for k in range(RAYS)]
    if sum(radius is not None for radius in radii) < 0.6 * RAYS:
        return "no wall around", None
    usual = sorted(radius for radius in radii if radius is not None)
    usual = usual[len(usual) // 2]
    radii = [radius if radius is not None and 0.5 * usual < radius < 1.7 * usual else usual for radius in radii]
    near = lambda k: sorted(radii[(k + d) % RAYS] for d in range(-3, 4))[3]
    line = [(x + near(k) * math.cos(2 * math.pi * k / RAYS), y + near(k) * math.sin(2 * math.pi * k / RAYS)) for k in range(RAYS)]
    middle = (sum(p[0] for p in line) / RAYS, sum(p[1] for p in line) / RAYS)
    return [[px / image.x_mm, py / image.y_mm] for px, py in line], middle


def main():
    source = sys.stdin.buffer
    hello = json.loads(source.readline())
    centre = None
    while line := source.readline():
        head = json.loads(line)
        image = Image(head, source.read(head["bytes"]), hello["dynamic_range_db"])
        centre = centre or first_centre(image)
        found, middle = lumen(image, centre) if centre else ("nothing dark with a bright border", None)
        if middle is None:
            answer = {"number": head["number"], "none": found}
        else:
            centre = middle
            answer = {"number": head["number"], "contours": [{"pixels": found, "sd_mm": 0.25, "common_sd_mm": 0.2}]}
        print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    main()
