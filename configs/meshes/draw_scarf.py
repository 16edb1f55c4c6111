#!/usr/bin/env python3
"""Draws scarf_0000.obj ... scarf_0007.obj and ball.obj beside this file.

The scarf, 380 x 70 mm, lies over a ball of radius 75 mm that stands on z = 0. What touches the ball is
the same in all frames; both ends, from z = 75 down, sway by one period in eight frames.
"""
import math
import pathlib

LENGTH, WIDTH = 380.0, 70.0
ALONG, ACROSS = 36, 8
RADIUS = 75.9  # of the scarf's middle layer about the ball's centre
CENTRE_Z = 75.0
FRAMES = 8
HANG = LENGTH / 2 - RADIUS * math.pi / 2  # of each end

FOLDER = pathlib.Path(__file__).resolve().parent


def point(s, t, frame):
    """World place in mm; s along the scarf, t across it, both from its middle."""
    side = math.copysign(1.0, s)
    arc = min(abs(s) / RADIUS, math.pi / 2)
    down = max(0.0, abs(s) - RADIUS * math.pi / 2)
    around = t / RADIUS
    x = RADIUS * math.sin(arc) * math.cos(around)
    z = CENTRE_Z + RADIUS * math.cos(arc) * math.cos(around) - down
    phase = 2 * math.pi * (frame / FRAMES + (0.3 if side > 0 else 0))
    share = (down / HANG) ** 2
    x += share * (9 * math.sin(2 * math.pi * down / 120 - phase) + 5 * math.cos(2 * math.pi * t / 35))
    y = RADIUS * math.sin(around) + share * 6 * math.sin(phase)
    return side * x, y, z


def write_scarf(frame):
    lines = [f"# A scarf over a ball, frame {frame}: draw_scarf.py. Millimetres; UVs of {LENGTH:.0f} mm."]
    for j in range(ACROSS + 1):
        for i in range(ALONG + 1):
            s = LENGTH * (i / ALONG - 0.5)
            t = WIDTH * (j / ACROSS - 0.5)
            lines.append("v %.3f %.3f %.3f" % point(s, t, frame))
    for j in range(ACROSS + 1):
        for i in range(ALONG + 1):
            lines.append("vt %.5f %.5f" % (i / ALONG, WIDTH / LENGTH * j / ACROSS))
    for j in range(ACROSS):
        for i in range(ALONG):
            a = j * (ALONG + 1) + i + 1
            corners = (a, a + 1, a + ALONG + 2, a + ALONG + 1)
            lines.append("f " + " ".join(f"{c}/{c}" for c in corners))
    (FOLDER / f"scarf_{frame:04d}.obj").write_text("\n".join(lines) + "\n")


def write_ball(rows=24, columns=48):
    """Radius 1 about the origin, with normals."""
    lines = ["# A ball of radius 1 about the origin: draw_scarf.py."]
    places = [(0.0, 0.0, 1.0)]
    for r in range(1, rows):
        t = math.pi * r / rows
        for c in range(columns):
            p = 2 * math.pi * c / columns
            places.append((math.sin(t) * math.cos(p), math.sin(t) * math.sin(p), math.cos(t)))
    places.append((0.0, 0.0, -1.0))
    lines += ["v %.6f %.6f %.6f" % p for p in places]
    lines += ["vn %.6f %.6f %.6f" % p for p in places]

    def vertex(r, c):
        if r == 0:
            return 1
        return len(places) if r == rows else 2 + (r - 1) * columns + c % columns

    for r in range(rows):
        for c in range(columns):
            corners = dict.fromkeys(
                (vertex(r, c), vertex(r + 1, c), vertex(r + 1, c + 1), vertex(r, c + 1)))
            lines.append("f " + " ".join(f"{v}//{v}" for v in corners))
    (FOLDER / "ball.obj").write_text("\n".join(lines) + "\n")


for number in range(FRAMES):
    write_scarf(number)
write_ball()
