#!/usr/bin/env python3
"""Draws drape.obj beside this file: a square of cloth that has fallen over a ball on a floor.

The cloth, 340 mm wide, is a net of points with springs of fixed length between neighbours, across squares and over
two squares (Mueller et al. 2007, position based dynamics). It falls on a coarse net first, which is then halved.
Takes a few minutes.
"""
import math
import pathlib

SIZE = 340.0
RADIUS = 76.0  # of the ball's centre to the cloth's middle layer; the ball stands on z = 0
FLOOR = 1.0
FRICTION = 0.6
NETS = ((20, 260), (40, 160), (80, 90))  # squares along an edge, steps


def constraints(n):
    """(a, b, length, stiffness) of a net of n squares."""
    edge = SIZE / n
    springs = []

    def add(i, j, k, l, stiffness):
        if 0 <= k <= n and 0 <= l <= n:
            length = edge * math.hypot(k - i, l - j)
            springs.append((j * (n + 1) + i, l * (n + 1) + k, length, stiffness))

    for j in range(n + 1):
        for i in range(n + 1):
            for di, dj, stiffness in ((1, 0, 1.0), (0, 1, 1.0), (1, 1, 0.25), (1, -1, 0.25), (2, 0, 0.12), (0, 2, 0.12)):
                add(i, j, i + di, j + dj, stiffness)
    return springs


def meet_ball_and_floor(x, y, z, last, k):
    px, py, pz = x[k], y[k], z[k]
    dz = pz - RADIUS
    d = math.sqrt(px * px + py * py + dz * dz)
    touches = False
    if d < RADIUS:
        s = RADIUS / max(d, 1e-9)
        px, py, pz = px * s, py * s, RADIUS + dz * s
        touches = True
    if pz < FLOOR:
        pz = FLOOR
        touches = True
    if touches:
        ox, oy, oz = last[k]
        px += FRICTION * (ox - px)
        py += FRICTION * (oy - py)
    x[k], y[k], z[k] = px, py, pz


def fall(n, steps, x, y, z):
    springs = constraints(n)
    edge = SIZE / n
    gravity = 0.03 * edge
    speed = [(0.0, 0.0, 0.0)] * len(x)
    for step in range(steps):
        last = list(zip(x, y, z))
        for k, (vx, vy, vz) in enumerate(speed):
            x[k] += vx
            y[k] += vy
            z[k] += vz - gravity
        for _ in range(6):
            for a, b, length, stiffness in springs:
                dx, dy, dz = x[b] - x[a], y[b] - y[a], z[b] - z[a]
                d = math.sqrt(dx * dx + dy * dy + dz * dz)
                s = 0.5 * stiffness * (1.0 - length / d)
                dx, dy, dz = s * dx, s * dy, s * dz
                x[a] += dx
                y[a] += dy
                z[a] += dz
                x[b] -= dx
                y[b] -= dy
                z[b] -= dz
            for k in range(len(x)):
                meet_ball_and_floor(x, y, z, last, k)
        keep = 0.97 if step < steps * 2 // 3 else 0.9
        speed = [(keep * (x[k] - l[0]), keep * (y[k] - l[1]), keep * (z[k] - l[2])) for k, l in enumerate(last)]


def halved(n, values):
    """Points of the net of 2 n squares, halfway between those of n."""
    fine = []
    for j in range(2 * n + 1):
        for i in range(2 * n + 1):
            corners = [values[b * (n + 1) + a] for a in {i // 2, (i + 1) // 2} for b in {j // 2, (j + 1) // 2}]
            fine.append(sum(corners) / len(corners))
    return fine


def main():
    n = NETS[0][0]
    turn = math.radians(12)
    x, y, z = [], [], []
    for j in range(n + 1):
        for i in range(n + 1):
            s, t = SIZE * (i / n - 0.5) + 4.0, SIZE * (j / n - 0.5) - 7.0
            x.append(math.cos(turn) * s - math.sin(turn) * t)
            y.append(math.sin(turn) * s + math.cos(turn) * t)
            # A slight unevenness, without which the folds would be as regular as the net.
            z.append(2 * RADIUS + 2.0 + 1.5 * math.sin(0.051 * s + 1.0) * math.cos(0.043 * t))
    for squares, steps in NETS:
        while n < squares:
            x, y, z = halved(n, x), halved(n, y), halved(n, z)
            n *= 2
        fall(n, steps, x, y, z)
    lines = [f"# A square of cloth over a ball of radius {RADIUS - 1:.0f} mm on a floor: draw_drape.py. Millimetres; UVs of {SIZE:.0f} mm."]
    lines += ["v %.2f %.2f %.2f" % place for place in zip(x, y, z)]
    lines += ["vt %.5f %.5f" % (i / n, j / n) for j in range(n + 1) for i in range(n + 1)]
    for j in range(n):
        for i in range(n):
            a = j * (n + 1) + i + 1
            corners = (a, a + 1, a + n + 2, a + n + 1)
            lines.append("f " + " ".join(f"{c}/{c}" for c in corners))
    (pathlib.Path(__file__).resolve().parent / "drape.obj").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
