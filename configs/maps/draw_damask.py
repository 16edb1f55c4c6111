#!/usr/bin/env python3
"""Draws damask.png: an ogee lattice with flowers and leaves, one pixel per block of the cloth.

White pixels are the figure, black ones the ground. Run from this folder; nothing but Python is needed.
"""
import math
import struct
import zlib

WIDTH, HEIGHT = 64, 88  # blocks of one repeat; half of it is the other half moved (a half drop)


def flower(x, y):
    """A rosette of eight petals about a ring."""
    r, angle = math.hypot(x, y), math.atan2(y, x)
    petals = r < 10.5 + 2.6 * math.cos(8 * angle)
    ring = 4.2 < r < 5.8
    return petals and not ring


def leaf(x, y, angle, length, width):
    """A pointed leaf from the origin, with a vein."""
    along = x * math.cos(angle) + y * math.sin(angle)
    across = -x * math.sin(angle) + y * math.cos(angle)
    if not 0 < along < length:
        return False
    half = width * math.sin(math.pi * along / length) ** 0.8
    return abs(across) < half and not (abs(across) < 0.6 and along > 0.25 * length)


def ornament(x, y):
    """The figure about one centre; x is mirrored."""
    x = abs(x)
    if flower(x, y):
        return True
    for angle, length, width in ((62, 25, 3.6), (20, 20, 3.0), (-24, 18, 2.6), (-66, 22, 3.2)):
        a = math.radians(angle)
        if leaf(x - 8 * math.cos(a), y - 8 * math.sin(a), a, length - 4, width):
            return True
    # a bud above and a stem below
    if math.hypot(x / 0.8, y - 25) < 4.2 and not math.hypot(x / 0.8, y - 25) < 1.6:
        return True
    return x < 0.9 and -38 < y < -13


def lattice(x, y):
    """Bands of an ogee between the ornaments."""
    wave = 0.25 * WIDTH * (1 + 0.86 * math.cos(2 * math.pi * y / HEIGHT))
    return min(abs(abs(x) - wave) % WIDTH, 99) < 1.5


def is_figure(column, row):
    x, y = column + 0.5 - WIDTH / 2, row + 0.5 - HEIGHT / 2
    moved_x = (x + WIDTH) % WIDTH - WIDTH / 2
    moved_y = (y + HEIGHT) % HEIGHT - HEIGHT / 2
    return ornament(x, y) or ornament(moved_x, moved_y) or lattice(x, y)


def write_png(path, rows):
    def chunk(kind, data):
        return (struct.pack(">I", len(data)) + kind + data
                + struct.pack(">I", zlib.crc32(kind + data)))

    raw = b"".join(b"\0" + bytes(255 if value else 0 for value in row) for row in rows)
    header = struct.pack(">IIBBBBB", len(rows[0]), len(rows), 8, 0, 0, 0, 0)
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header)
                   + chunk(b"IDAT", zlib.compress(raw, 9)) + chunk(b"IEND", b""))


if __name__ == "__main__":
    # Row 0 of the file is the top.
    write_png("damask.png",
              [[is_figure(column, HEIGHT - 1 - row) for column in range(WIDTH)] for row in range(HEIGHT)])
