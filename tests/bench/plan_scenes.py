#!/usr/bin/env python3
"""Plans held against charts: for every scene of a list, the picture that `heddle render --tolerance` makes, its error against the
chart's path-traced reference, and its cost beside the cheapest run of the chart that meets the same tolerance.

    tests/bench/plan_scenes.py build/release/heddle [FOLDER] [-o OUT] [--scenes a,b] [--core-seconds]

FOLDER (tests/bench/plan_scenes where absent) holds NAME.toml and list.json: [{"scene": NAME, "tolerance": X, "pictures": N,
"cached": BOOL,
"reference_spp": N}]. cached: the fabric's data are there, and rendering alone is the cost; otherwise the cache holds the accuracy tables
only, and building what a plan or a run needs counts once, rendering N times. The plan's own time always counts, once. Times are
wall clock, for an idle machine; --core-seconds counts processor time, which other work on the machine disturbs less. Charts in OUT
are kept and used again.
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


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("folder", nargs="?", type=pathlib.Path, default=pathlib.Path(__file__).parent / "plan_scenes")
    parser.add_argument("-o", "--output", type=pathlib.Path, default=pathlib.Path("out/plan_scenes"))
    parser.add_argument("--scenes", type=lambda names: names.split(","))
    parser.add_argument("--core-seconds", action="store_true")
    arguments = parser.parse_args()
    seconds = "core_seconds" if arguments.core_seconds else "seconds"
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
        chart_folder = output / entry["scene"]
        heddle(program, "chart", scene, "-o", chart_folder, "--cache", cache, "--resume", "-q", "--methods", METHODS,
               "--reference-spp", entry["reference_spp"])
        chart = json.loads((chart_folder / "chart.json").read_text())
        for cloth in tomllib.loads(scene.read_text())["cloth"]:
            if "fabric" in cloth:
                heddle(program, "accuracy", folder / cloth["fabric"], "--cache", cache, "-q")
        # A table of a stand-in is made by the first plan that asks for it.
        heddle(program, "plan", scene, "--tolerance", tolerance, "--cache", cache, "-q", statuses=(0, 1))
        picture = chart_folder / "planned.exr"
        with tempfile.TemporaryDirectory(dir=output) as fresh:
            if not cached:
                shutil.copytree(cache / "accuracy", pathlib.Path(fresh) / "accuracy")
            done = heddle(program, "render", scene, "-o", picture, "--tolerance", tolerance, "--pictures", pictures, "--cache",
                          cache if cached else fresh, "-q", "--json", statuses=(0, 1))
            build = 0
            for cost in pathlib.Path(fresh).glob("*/*.cost.json"):
                if cost.parent.name != "accuracy":
                    build += json.loads(cost.read_text())[seconds]
        if done.returncode != 0 and "no way meets" not in done.stderr:
            sys.exit(f"heddle render {scene}: {done.stderr}")
        if done.returncode != 0:
            print(f'| {entry["scene"]} | {tolerance:.0%} | {pictures} | | none | | | | | |', flush=True)
            continue
        report = json.loads(done.stdout)
        made = json.loads(picture.with_suffix(".json").read_text())
        reference = chart_folder / "runs" / f'{chart["references"]["full"]["key"]}.exr'
        error = json.loads(heddle(program, "compare", picture, reference, "--json").stdout)["relative_rmse"]
        plan = report["plan"][f"plan_{seconds}"]
        cost = build + plan + pictures * made[seconds]
        best = best_of_chart(chart["rows"], tolerance, pictures, cached, seconds)
        choice = report["plan"]["choice"]
        result = {**entry, "choice": choice["name"], "spp": made["heddle.spp"], "error": error, "expected_error": report["expected_error"],
                  "bias": choice["bias"], "noise_of_a_sample": choice["noise_of_a_sample"],
                  "build_seconds": build, "plan_seconds": plan, "render_seconds": made[seconds], "cost": cost,
                  "best_cost": best[0] if best else None, "best": best[1] if best else None}
        results.append(result)
        against = f"{best[0]:.2f} ({best[1]}) | {cost / best[0]:.2f}" if best else "none meets it |"
        print(f'| {entry["scene"]} | {tolerance:.0%} | {pictures} | {"there" if cached else "to build"} | {choice["name"]}, '
              f'{made["heddle.spp"]} spp | {error:.1%} (expected {report["expected_error"]:.1%}) | {cost:.2f} | {plan:.2f} | {against} |', flush=True)
    (output / "results.json").write_text(json.dumps(results, indent=1) + "\n")
    within = sum(r["error"] <= r["tolerance"] for r in results)
    near = sum(r["best_cost"] is None or r["cost"] <= 2 * r["best_cost"] for r in results)
    print(f"\n{within} of {len(results)} within the tolerance; {near} of {len(results)} within twice the cost of the chart's best.")


if __name__ == "__main__":
    main()
