"""Processor time per sample, noise of a sample (relative to the picture's mean), and what both together cost."""
import json
import math
import subprocess
import sys

heddle, out, pixels, bounces = sys.argv[1], sys.argv[2], int(sys.argv[3]), sys.argv[4]


def run(*arguments):
    return json.loads(subprocess.run([heddle, *arguments, "--json"], capture_output=True, text=True, check=True).stdout)


def ours(name):
    """Time from the report; noise from the variance that a picture holds of its own pixels."""
    report = json.load(open(f"{out}/{name}.json"))
    samples = int(report["heddle.spp"])
    channels = run("info", f"{out}/{name}.exr")
    mean_of = lambda channel: float(channels["channel." + channel].split()[2])  # "HALF  mean 0.0488  min 0  max 0.557"
    mean = [mean_of(c) for c in "RGB"]
    variance = sum(mean_of("Variance." + c) for c in "RGB") / 3
    time = report["core_seconds"] / (samples * pixels * pixels)
    return time, math.sqrt(variance * samples) / (sum(mean) / 3), mean


def cycles(shape):
    """Time between two numbers of samples, which leaves out the setup; noise from two pictures of different seeds."""
    record = json.load(open(f"{out}/cycles-{shape}.json"))
    first, second, short = record["runs"]
    core = (first["core_seconds"] + second["core_seconds"]) / 2 - short["core_seconds"]
    difference = run("compare", f"{out}/cycles-{shape}-1.exr", f"{out}/cycles-{shape}-2.exr")
    noise = difference["relative_rmse"] / math.sqrt(2) * math.sqrt(first["spp"])
    print(f"Cycles {record['blender']}, {shape.lower()}: {record['segments']} segments")
    return core / (first["spp"] - short["spp"]) / (pixels * pixels), noise, difference["mean_reference"]


rows = [
    (f"path, {bounces} bounces", ours("path")),
    ("path, all bounces", ours("path-all")),
    ("exact, all bounces", ours("exact")),
    (f"Cycles, thick curves, {bounces} bounces", cycles("THICK")),
    (f"Cycles, ribbons, {bounces} bounces", cycles("RIBBONS")),
]
cost = lambda row: row[1][0] * row[1][1] ** 2
print(f"{'':34}{'core-us / sample':>18}{'noise of a sample':>19}{'time x variance':>17}{'mean rgb':>28}")
for title, (time, noise, mean) in rows:
    print(
        f"{title:34}{1e6 * time:>18.2f}{noise:>19.2f}{cost((title, (time, noise, mean))) / cost(rows[0]):>17.3g}"
        f"{'':6}{mean[0]:.4f} {mean[1]:.4f} {mean[2]:.4f}"
    )
print("time x variance: processor time to the same relative noise, the first row's is 1")
