#!/usr/bin/env python3
"""The standard charts of docs/charts/: data as JSON, one SVG each, and a README.md with the figures.

    python3 tests/bench/standard_charts.py [-o docs/charts] [--build build/release] [--cache DIR] [--fabrics NAME,NAME]
                                           [--paths N] [--only NAME,NAME]

  flat        492 pairs of view and light on flat cloth, RMSE of every method and fabric (Khungurn et al. 2017, figure 13)
  cells       the same by the size of the transfer cells (figure 8)
  order       the same by the order of the harmonics (figure 9)
  sharpness   the same by the light's sharpness, from 1 to 10,000, and directional
  distance    relative RMSE of pixels of a flat swatch by the size of a pixel
  drape       time and error of the methods on draped cloth (table 2)
  catalogue   the full fabrics: figures as in table 1, times and bytes, and their RMSE on flat cloth

`--full` runs the charts on the full catalogue; without it, all but `catalogue` run on three tiny fabrics. On 2 cores, `--full --only flat,cells,order,drape`
takes a night.

Needs a Release build. Every JSON says what ran: command, program version, key of the pack, seed, seconds. Measure on an idle machine. The
default takes about half an hour on 2 cores; --only makes some again.
"""
import argparse
import csv
import json
import math
import os
import subprocess
import sys
import tempfile
import time

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
COLOURS = ["#000000", "#d62728", "#1f77b4", "#2ca02c", "#9467bd", "#ff7f0e", "#8c564b", "#e377c2", "#7f7f7f", "#17becf"]
VIEWS, LIGHTS = 41, 12
TINY = ["cotton-tiny", "wool-tiny", "silk-tiny"]
# The counterparts of table 1 first.
FULL = ["fleece", "wool-gabardine", "silk-satin", "satin-4-1", "satin-2-3", "satin-1-4", "shot-silk-a", "shot-silk-b",
        "silk-organza", "cotton-voile", "corduroy", "poplin-stripes", "linen-canvas", "jersey", "rib-1x1", "denim"]


class Tools:
    """The programs, and a record of what they did."""

    def __init__(self, options):
        self.options = options
        self.heddle = os.path.join(options.build, "heddle")
        self.swatch = os.path.join(options.build, "tests/bench/heddle_flat_swatch")
        self.version = subprocess.run([self.heddle, "--version"], capture_output=True, text=True, check=True).stdout.strip()
        self.folder = tempfile.mkdtemp(prefix="heddle-charts-")

    def run(self, command):
        start = time.time()
        print("+", " ".join(command), file=sys.stderr, flush=True)
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(f"{' '.join(command)}\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
        return done.stdout, time.time() - start

    def pack(self, fabric, changes=None, order=None):
        """Bakes a fabric, with lines of its [transfer] changed; (folder of the pack, its key, seconds)."""
        path = os.path.join(ROOT, "configs/fabrics", fabric + ".toml")
        if changes:
            text = open(path).read().replace("[transfer]", "[transfer]\n" + "\n".join(changes))
            path = os.path.join(self.folder, f"{fabric}-{abs(hash(tuple(changes)))}.toml")
            open(path, "w").write(text)
        command = [self.heddle, "precompute", path, "--cache", self.options.cache, "--quiet", "--json"]
        if order is not None:
            command += ["--order", str(order)]
        out, seconds = self.run(command)
        stages = json.loads(out)["stages"]
        folder = next(stage["artifact"] for stage in stages if stage["stage"] == "pack")
        manifest = json.load(open(os.path.join(folder, "manifest.json")))
        return folder, manifest, seconds

    def flat(self, fabric, sharpness=None, rivals=False, changes=None, order=None):
        """RMSE of each method on flat cloth, with what made it."""
        folder, manifest, baked = self.pack(fabric, changes, order)
        prefix = os.path.join(self.folder, "swatch")
        command = [self.swatch, folder, "--paths", str(self.options.paths), "--seed", "1", "--out", prefix]
        if not rivals:
            command.append("--no-rivals")
        if sharpness is not None:
            command += ["--sharpness", str(sharpness)]
        _, seconds = self.run(command)
        rows = flat_errors(prefix + ".csv")
        return {"fabric": fabric, "sharpness": sharpness, "changes": changes or [], "order": order,
                "cells": manifest["counts"].get("cells"), "methods": rows,
                "origin": {"command": " ".join(os.path.basename(c) if os.sep in c else c for c in command),
                           "pack_key": manifest["key"], "seed": 1, "program_version": self.version,
                           "precompute_seconds": round(baked, 2), "seconds": round(seconds, 2)}}


def flat_errors(path):
    """sqrt(mean (F1 - R1)(F2 - R2)) / mean R over views, lights and colours, of single + multiple; with a jackknife over views."""
    values = {}
    for row in csv.DictReader(open(path)):
        key = (row["method"], int(row["half"]), row["view_deg"], row["light_theta_deg"], row["light_azimuth_deg"])
        rgb = values.setdefault(key, [0.0, 0.0, 0.0])
        for c, name in enumerate("rgb"):
            rgb[c] += float(row[name])
    methods = []
    for key in values:
        if key[0] not in methods:
            methods.append(key[0])
    pairs = sorted({key[2:] for key in values if key[0] == "reference"})
    views = sorted({pair[0] for pair in pairs}, key=float)
    result = {}
    for method in methods:
        if method == "reference":
            continue
        square = {view: 0.0 for view in views}
        mean_f = mean_r = 0.0
        for pair in pairs:
            f = [values[(method, half) + pair] for half in (0, 1)]
            r = [values[("reference", half) + pair] for half in (0, 1)]
            for c in range(3):
                square[pair[0]] += (f[0][c] - r[0][c]) * (f[1][c] - r[1][c])
                mean_f += (f[0][c] + f[1][c]) / 2
                mean_r += (r[0][c] + r[1][c]) / 2
        count = 3 * len(pairs)
        mean_r /= count
        total = sum(square.values())
        per_view = count / len(views)
        error = math.sqrt(max(0.0, total / count)) / mean_r
        left_out = [(total - square[v]) / (count - per_view) for v in views]
        centre = sum(left_out) / len(views)
        spread = math.sqrt((len(views) - 1) / len(views) * sum((x - centre) ** 2 for x in left_out))
        low = math.sqrt(max(0.0, total / count - 1.96 * spread)) / mean_r
        high = math.sqrt(max(0.0, total / count + 1.96 * spread)) / mean_r
        result[method] = {"rmse": error, "low": low, "high": high, "mean_ratio": mean_f / count / mean_r}
    return result


# ---- charts

def svg_lines(path, title, x_name, y_name, curves, log_x=False, log_y=False, x_labels=None):
    """curves: [(name, [(x, y, low, high)])]; low and high may be None."""
    width, height, left, top, right, bottom = 760, 420, 64, 40, 190, 52
    xs = [p[0] for _, points in curves for p in points]
    ys = [v for _, points in curves for p in points for v in p[1:] if v is not None and (v > 0 or not log_y)]
    fx = math.log10 if log_x else float
    x0, x1 = fx(min(xs)), fx(max(xs))
    if x1 == x0:
        x1 = x0 + 1
    if log_y:
        y0, y1 = math.floor(math.log10(min(ys)) * 2) / 2, math.ceil(math.log10(max(ys)) * 2) / 2
    else:
        y0, y1 = 0.0, max(ys) * 1.08
    place_x = lambda x: left + (fx(x) - x0) / (x1 - x0) * (width - left - right)
    def place_y(y):
        value = math.log10(max(y, 1e-12)) if log_y else y
        return height - bottom - (min(max(value, y0), y1) - y0) / (y1 - y0) * (height - top - bottom)
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" font-family="sans-serif" font-size="12">',
           '<rect width="100%" height="100%" fill="#ffffff"/>', f'<text x="{left}" y="22" font-size="15">{title}</text>',
           f'<rect x="{left}" y="{top}" width="{width - left - right}" height="{height - top - bottom}" fill="none" stroke="#999999"/>',
           f'<text x="{(left + width - right) / 2}" y="{height - 12}" text-anchor="middle">{x_name}</text>',
           f'<text x="16" y="{(top + height - bottom) / 2}" text-anchor="middle" transform="rotate(-90 16 {(top + height - bottom) / 2})">{y_name}</text>']
    ticks = x_labels or [(x, f"{x:g}") for x in sorted(set(xs))]
    for x, label in ticks:
        out.append(f'<line x1="{place_x(x):.1f}" x2="{place_x(x):.1f}" y1="{height - bottom}" y2="{height - bottom + 4}" stroke="#555555"/>'
                   f'<text x="{place_x(x):.1f}" y="{height - bottom + 17}" text-anchor="middle">{label}</text>')
    if log_y:
        y_ticks = [m * 10.0 ** e for e in range(math.floor(y0), math.ceil(y1) + 1) for m in (1, 2, 5)]
        y_ticks = [y for y in y_ticks if y0 - 1e-9 <= math.log10(y) <= y1 + 1e-9]
    else:
        step = 10 ** math.floor(math.log10(y1 / 4))
        step = next(step * m for m in (1, 2, 5, 10) if y1 / (step * m) <= 7)
        y_ticks = [step * k for k in range(int(y1 / step) + 1)]
    for y in y_ticks:
        out.append(f'<line x1="{left}" x2="{width - right}" y1="{place_y(y):.1f}" y2="{place_y(y):.1f}" stroke="#e5e5e5"/>'
                   f'<text x="{left - 6}" y="{place_y(y) + 4:.1f}" text-anchor="end">{100 * y:g} %</text>')
    for k, (name, points) in enumerate(curves):
        colour = COLOURS[k % len(COLOURS)]
        line = " ".join(f"{place_x(p[0]):.1f},{place_y(p[1]):.1f}" for p in points)
        out.append(f'<polyline fill="none" stroke="{colour}" stroke-width="1.6" points="{line}"/>')
        for p in points:
            if p[2] is not None:
                out.append(f'<line x1="{place_x(p[0]):.1f}" x2="{place_x(p[0]):.1f}" y1="{place_y(p[2]):.1f}" y2="{place_y(p[3]):.1f}" stroke="{colour}"/>')
            out.append(f'<circle cx="{place_x(p[0]):.1f}" cy="{place_y(p[1]):.1f}" r="3" fill="{colour}"><title>{name}: {p[0]:g}, {100 * p[1]:.2f} %</title></circle>')
        out.append(f'<text x="{width - right + 12}" y="{top + 14 + 17 * k}" fill="{colour}">{name}</text>')
    out.append("</svg>")
    open(path, "w").write("\n".join(out) + "\n")


def svg_bars(path, title, groups):
    """groups: [(fabric, [(method, value, low, high)])]: bars on a logarithmic axis."""
    bar, gap, left, top, bottom, plot = 15, 26, 64, 56, 24, 300
    methods = []
    for _, bars in groups:
        for name, *_ in bars:
            if name not in methods:
                methods.append(name)
    width = left + sum(len(bars) * bar + gap for _, bars in groups) + 170
    low, high = math.log10(0.01), math.log10(3)
    place = lambda v: top + plot - (min(max(math.log10(max(v, 1e-6)), low), high) - low) / (high - low) * plot
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{top + plot + bottom + 20}" font-family="sans-serif" font-size="12">',
           '<rect width="100%" height="100%" fill="#ffffff"/>', f'<text x="{left}" y="24" font-size="15">{title}</text>']
    for v in (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2):
        out.append(f'<line x1="{left}" x2="{width - 160}" y1="{place(v):.1f}" y2="{place(v):.1f}" stroke="#e5e5e5"/>'
                   f'<text x="{left - 6}" y="{place(v) + 4:.1f}" text-anchor="end">{100 * v:g} %</text>')
    x = left + gap / 2
    for fabric, bars in groups:
        out.append(f'<text x="{x + len(bars) * bar / 2:.1f}" y="{top + plot + 17}" text-anchor="middle">{fabric}</text>')
        for name, value, lo, hi in bars:
            colour = COLOURS[(methods.index(name) + 1) % len(COLOURS)]
            out.append(f'<rect x="{x + 1:.1f}" y="{place(value):.1f}" width="{bar - 2}" height="{top + plot - place(value):.1f}" fill="{colour}"><title>{fabric}, {name}: {100 * value:.1f} %</title></rect>'
                       f'<line x1="{x + bar / 2:.1f}" x2="{x + bar / 2:.1f}" y1="{place(lo):.1f}" y2="{place(hi):.1f}" stroke="#333333"/>')
            x += bar
        x += gap
    for k, name in enumerate(methods):
        out.append(f'<rect x="{width - 150}" y="{top + 18 * k}" width="11" height="11" fill="{COLOURS[(k + 1) % len(COLOURS)]}"/>'
                   f'<text x="{width - 133}" y="{top + 10 + 18 * k}">{name}</text>')
    out.append("</svg>")
    open(path, "w").write("\n".join(out) + "\n")


def point(x, row):
    return (x, row["rmse"], row["low"], row["high"])


# ---- what is measured

def chart_flat(tools, folder):
    runs = [tools.flat(fabric, rivals=True) for fabric in tools.options.fabrics]
    shown = ["exact", "volume", "floor", "path-6", "prt", "tsai-shih-16", "tsai-shih-full", "dual-scattering"]
    svg_bars(f"{folder}/flat.svg", "Flat cloth, 41 views x 12 directional lights: RMSE over the mean",
             [(run["fabric"], [(m, *point(0, run["methods"][m])[1:]) for m in shown if m in run["methods"]]) for run in runs])
    table = ["| fabric | " + " | ".join(shown) + " |", "| --- |" + " --- |" * len(shown)]
    for run in runs:
        table.append(f"| {run['fabric']} | " + " | ".join(
            f"{100 * run['methods'][m]['rmse']:.1f} % ({run['methods'][m]['mean_ratio']:.2f})" if m in run["methods"] else "" for m in shown) + " |")
    return runs, "RMSE, in brackets the mean over the reference's.\n\n" + "\n".join(table)


def chart_catalogue(tools, folder):
    """One row per full fabric. Times are those that the cache keeps: of the bake that made its data."""
    runs, groups = [], []
    table = ["| fabric | segments | radius um | mean free path um | cells | order | MB | maps core min | transfer core min | "
             "exact | volume |", "| --- |" + " --- |" * 10]
    for fabric in tools.options.fabrics:
        run = tools.flat(fabric)
        pack, _, _ = tools.pack(fabric)
        info = json.loads(tools.run([tools.heddle, "info", pack, "--json"])[0])
        stages = json.loads(tools.run([tools.heddle, "precompute", os.path.join(ROOT, "configs/fabrics", fabric + ".toml"),
                                       "--cache", tools.options.cache, "--quiet", "--json", "--dry-run"])[0])["forecast"]
        cloth = json.loads(tools.run([tools.heddle, "info", os.path.join(ROOT, "configs/fabrics", fabric + ".toml"), "--json"])[0])
        radii = sorted({round(yarn["fiber_radius_um"], 2) for yarn in cloth["yarns"].values()})
        size = sum(os.path.getsize(os.path.join(pack, name)) for name in os.listdir(pack))
        minutes = {stage["stage"]: stage["core_seconds"] / 60 for stage in stages}
        methods = run["methods"]
        run.update({"info": info, "bytes": size, "core_minutes": minutes, "radius_um": radii})
        runs.append(run)
        groups.append((fabric, [(m, *point(0, methods[m])[1:]) for m in ("exact", "volume")]))
        table.append(f"| {fabric} | {info['segments']:,} | {' to '.join(f'{r:g}' for r in radii)} | {1000 * info['mean_free_path_mm']:.3g} | "
                     f"{info['cells']:,} | {info['transfer_order']} | {size / 1e6:.0f} | {minutes['maps']:.1f} | {minutes['transfer']:.1f} | "
                     + " | ".join(f"{100 * methods[m]['rmse']:.1f} % ({methods[m]['mean_ratio']:.2f})" for m in ("exact", "volume")) + " |")
    svg_bars(f"{folder}/catalogue.svg", "Full fabrics on flat cloth, 41 views x 12 directional lights: RMSE over the mean", groups)
    return runs, "RMSE of 492 pairs, in brackets the mean over the reference's.\n\n" + "\n".join(table)


def sweep(tools, folder, name, title, x_name, settings, log_x):
    """settings: [(x, keyword arguments of Tools.flat)]"""
    runs, curves = [], []
    for fabric in tools.options.fabrics:
        points = []
        for x, keywords in settings:
            run = tools.flat(fabric, **keywords)
            run["x"] = x
            runs.append(run)
            points.append(point(x, run["methods"]["exact"]))
        curves.append((fabric, points))
    svg_lines(f"{folder}/{name}.svg", title, x_name, "RMSE over the mean, exact", curves, log_x)
    table = [f"| fabric | " + " | ".join(f"{x:g}" for x, _ in settings) + " |", "| --- |" + " --- |" * len(settings)]
    for fabric, points in curves:
        table.append(f"| {fabric} | " + " | ".join(f"{100 * p[1]:.1f} %" for p in points) + " |")
    return runs, "\n".join(table)


def chart_cells(tools, folder):
    return sweep(tools, folder, "cells", "Flat cloth by the size of the transfer cells", "edge of a cube of as many cells, mean free paths",
                 [(size, {"changes": [f"cell_mean_free_paths = {size}"]}) for size in (2, 4, 8, 16, 32)], True)


def chart_order(tools, folder):
    return sweep(tools, folder, "order", "Flat cloth by the order of the harmonics", "highest band",
                 [(order, {"order": order}) for order in range(6)], False)


def chart_sharpness(tools, folder):
    runs, text = sweep(tools, folder, "sharpness", "Flat cloth by the sharpness of the light", "sharpness (right: directional)",
                       [(s, {"sharpness": s}) for s in (1, 3, 10, 30, 100, 300, 1000, 10000)] + [(100000, {})], True)
    return runs, text.replace(" 100000 |", " directional |").replace(" 1e+05 |", " directional |")


def scene_of(tools, name, fabric, lines):
    path = os.path.join(tools.folder, name + ".toml")
    meshes = os.path.join(ROOT, "configs/meshes")
    text = f"""name = "{name}"
background = [0, 0, 0]
{lines}
[[light]]
type = "sg"
axis = [0.5, -0.6, 1]
sharpness = 150
irradiance = [2.4, 2.3, 2.1]

[[cloth]]
mesh = "{meshes}/drape_sphere_64.obj"
mesh_unit = "m"
uv_size_mm = 300
fabric = "{ROOT}/configs/fabrics/{fabric}.toml"
underlay = true

[render]
method = "exact"
"""
    open(path, "w").write(text)
    return path


def chart_rows(tools, scene, methods, keywords):
    folder = os.path.join(tools.folder, os.path.basename(scene)[:-5])
    command = [tools.heddle, "chart", scene, "-o", folder, "--cache", tools.options.cache, "--methods", methods, "--quiet"] + keywords
    _, seconds = tools.run(command)
    document = json.load(open(os.path.join(folder, "chart.json")))
    return document, seconds


def error_of(row, reference):
    error = row["error"][reference]
    return error["relative_rmse"], error["relative_rmse_low"], error["relative_rmse_high"]


def chart_distance(tools, folder):
    """The drape's top from 0.1 to 6.4 m, 32 pixels of 0.9 degrees each across."""
    runs, curves = [], []
    for fabric in tools.options.fabrics:
        points = []
        for distance in (12.5, 25, 50, 100, 200, 400):
            lines = f"""[camera]
position_mm = [0, {-0.6 * distance}, {76 + 0.8 * distance}]
look_at_mm = [0, 0, 76]
up = [0, 0, 1]
fov_deg = 4
fov_axis = "horizontal"
resolution_px = [32, 32]
spp = 64
"""
            scene = scene_of(tools, f"distance-{fabric}-{distance:g}", fabric, lines)
            document, seconds = chart_rows(tools, scene, "exact", ["--reference-spp", "512"])
            rows = [row for row in document["rows"] if row["status"] == "done" and row["method"] == "exact"]
            row = max(rows, key=lambda r: r["settings"].get("spp", 0))
            pixel_um = 1000 * distance * math.radians(4) / 32
            runs.append({"fabric": fabric, "distance_mm": distance, "pixel_um": pixel_um, "seconds": round(seconds, 2), "row": row})
            points.append((pixel_um, *error_of(row, "local")))
        curves.append((fabric, points))
    svg_lines(f"{folder}/distance.svg", "Draped cloth by the size of a pixel (exact, 64 spp, against light within the shell)", "pixel, um",
              "relative RMSE per pixel", curves, True, x_labels=[(p[0], f"{p[0]:.0f}") for p in curves[0][1]])
    table = ["| fabric | " + " | ".join(f"{p[0]:.0f} um" for p in curves[0][1]) + " |", "| --- |" + " --- |" * len(curves[0][1])]
    for fabric, points in curves:
        table.append(f"| {fabric} | " + " | ".join(f"{100 * p[1]:.1f} %" for p in points) + " |")
    return runs, "Noise of 64 samples counts.\n\n" + "\n".join(table)


def chart_drape(tools, folder):
    runs, curves = [], []
    table = ["| fabric | method | samples | render s | precompute s | relative RMSE |", "| --- | --- | --- | --- | --- | --- |"]
    for fabric in tools.options.fabrics:
        lines = """[camera]
position_mm = [0, -147.6, 196.8]
look_at_mm = [0, -45.6, 60.8]
up = [0, 0, 1]
fov_deg = 4.04
fov_axis = "horizontal"
resolution_px = [64, 48]
spp = 16
"""
        scene = scene_of(tools, f"drape-{fabric}", fabric, lines)
        document, seconds = chart_rows(tools, scene, "path,exact,volume", ["--width", "64", "--reference-spp", "512"])
        rows = [row for row in document["rows"] if row["status"] == "done"]
        for method in ("path", "exact", "volume"):
            mine = sorted((row for row in rows if row["method"] == method), key=lambda r: r["settings"].get("spp", 0))
            curves.append((f"{fabric}, {method}", [(max(1e-3, row["render_seconds"]), *error_of(row, "full")) for row in mine]))
            for row in mine:
                precompute = row.get("precompute_seconds")
                table.append(f"| {fabric} | {method} | {row['settings'].get('spp')} | {row['render_seconds']:.2f} | "
                             f"{'' if precompute is None else format(precompute, '.1f')} | {100 * error_of(row, 'full')[0]:.1f} % |")
        runs.append({"fabric": fabric, "seconds": round(seconds, 2), "rows": rows})
    xs = [0.01, 0.1, 1, 10, 100]
    shown = [p[0] for _, points in curves for p in points]
    ticks = [(x, f"{x:g}") for x in xs if min(shown) <= x <= max(shown)]
    svg_lines(f"{folder}/drape.svg", "Close-up of draped cloth, 64 x 48 pixels, against all light", "seconds to render", "relative RMSE per pixel",
              curves, True, True, ticks)
    return runs, "\n".join(table)


CHARTS = {"flat": ("Every method on flat cloth", chart_flat), "cells": ("Size of the cells", chart_cells),
          "order": ("Order of the harmonics", chart_order), "sharpness": ("Sharpness of the light", chart_sharpness),
          "distance": ("View distance", chart_distance), "drape": ("Time and error on draped cloth", chart_drape),
          "catalogue": ("The full fabrics", chart_catalogue)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", default=os.path.join(ROOT, "docs/charts"))
    parser.add_argument("--build", default=os.path.join(ROOT, "build/release"))
    parser.add_argument("--cache", default=os.path.join(ROOT, "build/charts-cache"))
    parser.add_argument("--fabrics", help="names, in place of those that a chart takes by itself")
    parser.add_argument("--full", action="store_true", help="the full catalogue for every chart")
    parser.add_argument("--paths", type=int, default=2000, help="eye rays per view on flat cloth")
    parser.add_argument("--only", default=",".join(name for name in CHARTS if name != "catalogue"))
    options = parser.parse_args()
    named = options.fabrics.split(",") if options.fabrics else None
    unknown = set(options.only.split(",")) - set(CHARTS)
    if unknown:
        sys.exit(f"no such chart: {', '.join(sorted(unknown))}; expected some of {', '.join(CHARTS)}")
    os.makedirs(options.output, exist_ok=True)
    tools = Tools(options)
    for name in options.only.split(","):
        options.fabrics = named or (FULL if options.full or name == "catalogue" else TINY)
        runs, text = CHARTS[name][1](tools, options.output)
        document = {"chart": name, "program_version": tools.version, "threads": os.cpu_count(), "paths": options.paths,
                    "text": text, "runs": runs}
        with open(f"{options.output}/{name}.json", "w") as file:
            json.dump(document, file, indent=1)
            file.write("\n")
    page = ["# Standard charts", "",
            "`python3 tests/bench/standard_charts.py` makes these charts, and its first lines say what each is. Each JSON holds the",
            "figures with the command, key, seed, seconds and program version behind them. Bars are 95 % intervals. 0 % means that",
            "the error cannot be told from none, because the reference's noise outweighs it.", ""]
    for name, (title, _) in CHARTS.items():
        path = f"{options.output}/{name}.json"
        if not os.path.exists(path):
            continue
        page += [f"## {title}", "", f"![{title}]({name}.svg)", "", json.load(open(path))["text"], ""]
    open(f"{options.output}/README.md", "w").write("\n".join(page))


if __name__ == "__main__":
    main()
