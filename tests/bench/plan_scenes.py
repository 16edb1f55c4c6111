#!/usr/bin/env python3
"""Plans held against charts: for every scene of a list, the picture that `heddle render --tolerance` makes, its error against the
chart's path-traced reference, and its cost beside the cheapest run of the chart that meets the same tolerance.

    tests/bench/plan_scenes.py build/release/heddle [FOLDER] [-o OUT] [--scenes a,b] [--core-seconds] [--no-charts] [-j N]

FOLDER (tests/bench/plan_scenes where absent) holds NAME.toml and list.json: [{"scene": NAME, "tolerance": X, "pictures": N,
"cached": BOOL, "reference_spp": N}]. cached: the fabric's data are there, and rendering alone is the cost. Otherwise the cache holds
the accuracy tables only; building what a plan or a run needs counts once, rendering N times. The plan's own time always counts, once.
Times are wall clock, for an idle machine. --core-seconds counts processor time, which other work on the machine disturbs less.
Charts in OUT are kept and used again. --no-charts makes the path-traced reference alone, in a fraction of the time: errors and costs,
without the best of the chart.
"""

import argparse
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import tomllib

# Rivals that are never cheapest take most of a chart's time.
METHODS = "path,exact,volume,path-6,dual-scattering"


def heddle(program, *arguments, statuses=(0,)):
    done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True)
    if done.returncode not in statuses:
        sys.exit(f"heddle {' '.join(map(str, arguments))}: status {done.returncode}\n{done.stderr}")
    return done


def best_of_chart(rows, tolerance, pictures, cached, seconds):
    """(cost, run) of the cheapest run within the tolerance."""
    best = None
    for row in rows:
        if row["status"] != "done" or row["error"]["full"]["relative_rmse"] > tolerance:
            continue
        if not cached and row[f"precompute_{seconds}"] is None:
            continue
        cost = pictures * row[f"render_{seconds}"] + (0 if cached else row[f"precompute_{seconds}"])
        if best is None or cost < best[0]:
            best = (cost, f'{row["method"]}, {row["label"]}')
    return best


def chart_of(program, scene, folder, reference_spp, cache, threads):
    """(rows of the chart, its reference)."""
    heddle(program, "chart", scene, "-o", folder, "--cache", cache, "--resume", "-q", "--methods", METHODS,
           "--reference-spp", reference_spp, *threads)
    chart = json.loads((folder / "chart.json").read_text())
    return chart["rows"], folder / "runs" / f'{chart["references"]["full"]["key"]}.exr'


def reference_of(program, scene, folder, reference_spp, cache, threads):
    """A path-traced picture with the next seed, as the reference of a chart has: one that shares the picture's random numbers
    would make errors look smaller."""
    reference = folder / "reference.exr"
    if not reference.exists():
        folder.mkdir(exist_ok=True)
        heddle(program, "render", scene, "-o", reference, "--method", "path", "--spp", reference_spp, "--seed", 2, "--cache", cache,
               "-q", *threads)
    return reference


def planned_picture(program, scene, entry, picture, cache, seconds, threads):
    """(report of the job, report of the picture, seconds of building), or None where no way meets the tolerance."""
    with tempfile.TemporaryDirectory(dir=picture.parent) as fresh:
        if not entry["cached"]:
            shutil.copytree(cache / "accuracy", pathlib.Path(fresh) / "accuracy")
        done = heddle(program, "render", scene, "-o", picture, "--tolerance", entry["tolerance"], "--pictures", entry["pictures"],
                      "--cache", cache if entry["cached"] else fresh, "-q", "--json", *threads, statuses=(0, 1))
        build = 0
        for record in pathlib.Path(fresh).glob("*/*.record.json"):
            if record.parent.name != "accuracy":
                build += json.loads(record.read_text())[seconds]
    if done.returncode != 0 and "no way meets" not in done.stderr:
        sys.exit(f"heddle render {scene}: {done.stderr}")
    if done.returncode != 0:
        return None
    return json.loads(done.stdout), json.loads(picture.with_suffix(".json").read_text()), build


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("folder", nargs="?", type=pathlib.Path, default=pathlib.Path(__file__).parent / "plan_scenes")
    parser.add_argument("-o", "--output", type=pathlib.Path, default=pathlib.Path("out/plan_scenes"))
    parser.add_argument("--scenes", type=lambda names: names.split(","))
    parser.add_argument("--core-seconds", action="store_true")
    parser.add_argument("--no-charts", action="store_true")
    parser.add_argument("-j", "--threads", type=int)
    arguments = parser.parse_args()
    seconds = "core_seconds" if arguments.core_seconds else "seconds"
    threads = ["-j", arguments.threads] if arguments.threads else []
    program, folder, output = arguments.program, arguments.folder, arguments.output
    output.mkdir(parents=True, exist_ok=True)
    cache = output / "cache"

    results = []
    print("| scene | tolerance | pictures | data | choice | error | cost (s) | of it the plan | best of the chart (s) | ratio |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    for entry in json.loads((folder / "list.json").read_text()):
        if arguments.scenes and entry["scene"] not in arguments.scenes:
            continue
        scene = folder / f'{entry["scene"]}.toml'
        tolerance, pictures, cached = entry["tolerance"], entry["pictures"], entry["cached"]
        own_folder = output / entry["scene"]
        if arguments.no_charts:
            rows, reference = [], reference_of(program, scene, own_folder, entry["reference_spp"], cache, threads)
        else:
            rows, reference = chart_of(program, scene, own_folder, entry["reference_spp"], cache, threads)
        for cloth in tomllib.loads(scene.read_text())["cloth"]:
            if "fabric" in cloth:
                heddle(program, "accuracy", folder / cloth["fabric"], "--cache", cache, "-q", *threads)
        # A table of a stand-in is made by the first plan that asks for it.
        heddle(program, "plan", scene, "--tolerance", tolerance, "--cache", cache, "-q", *threads, statuses=(0, 1))
        picture = own_folder / "planned.exr"
        planned = planned_picture(program, scene, entry, picture, cache, seconds, threads)
        if planned is None:
            print(f'| {entry["scene"]} | {tolerance:.0%} | {pictures} | | none | | | | | |', flush=True)
            continue
        report, made, build = planned
        error = json.loads(heddle(program, "compare", picture, reference, "--json").stdout)["relative_rmse"]
        plan = report["plan"][f"plan_{seconds}"]
        cost = build + plan + pictures * made[seconds]
        best = best_of_chart(rows, tolerance, pictures, cached, seconds)
        choice = report["plan"]["choice"]
        result = {**entry, "choice": choice["name"], "spp": made["heddle.spp"], "error": error, "expected_error": report["expected_error"],
                  "bias": choice["bias"], "noise_of_a_sample": choice["noise_of_a_sample"],
                  "build_seconds": build, "plan_seconds": plan, "render_seconds": made[seconds], "cost": cost,
                  "best_cost": best[0] if best else None, "best": best[1] if best else None}
        results.append(result)
        against = f"{best[0]:.2f} ({best[1]}) | {cost / best[0]:.2f}" if best else "|" if arguments.no_charts else "none meets it |"
        print(f'| {entry["scene"]} | {tolerance:.0%} | {pictures} | {"there" if cached else "to build"} | {choice["name"]}, '
              f'{made["heddle.spp"]} spp | {error:.1%} (expected {report["expected_error"]:.1%}) | {cost:.2f} | {plan:.2f} | {against} |', flush=True)
    (output / "results.json").write_text(json.dumps(results, indent=1) + "\n")
    within = sum(r["error"] <= r["tolerance"] for r in results)
    summary = f"\n{within} of {len(results)} within the tolerance"
    if arguments.no_charts:
        print(f'{summary}; {sum(r["cost"] for r in results):.1f} s in all.')
        return
    near = sum(r["best_cost"] is None or r["cost"] <= 2 * r["best_cost"] for r in results)
    print(f"{summary}; {near} of {len(results)} within twice the cost of the chart's best.")


if __name__ == "__main__":
    main()
