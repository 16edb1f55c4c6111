"""Faults at every write, flush, close, rename, open, ... of every command, one at a time.

Each command runs once undisturbed, which says how many calls of each kind it makes below the case's folder; then once for each of
them with that call failing. Laws, for every one:
  - exit status 0 only with all outputs there and right; else a message that names the file and the system's reason;
  - each file under its final name, and each pack as a whole, is the old one or the new one;
  - no temporary file stays (but where removing was made to fail);
  - the same command once more succeeds and leaves the same bytes as an undisturbed run.
A short write, and a folder that cannot be opened for flushing or flushed, are no failures at all. An artifact of the cache that cannot
be read is built again.
"""

import collections
import shutil
import sys

import workshop
from workshop import (PACK, PICTURE, PICTURES, Fault, Job, States, differences, ended_by_signal, is_temporary, old_or_new,
                      says_why, temporaries, tree)

# Calls tried of one kind in one command; beyond that an even sample, the first and the last among them.
MOST = 3
MOST_HARMLESS = 2  # of calls whose failure touches no file, and of a chart, which is slow
HARMLESS = ("read", "open-read", "flush-folder", "open-folder")

# What is done to calls of each kind: (error, lasting). A short write with all after it failing is a disk that is full.
FAULTS = {
    "write": [("ENOSPC", False), ("short", False), ("short", True)],
    "read": [("EIO", False), ("short", False)],
    "flush": [("EIO", False)],
    "flush-folder": [("EOPNOTSUPP", False)],
    "close": [("EIO", False)],
    "rename": [("EIO", False)],
    "open-write": [("EMFILE", False)],
    "open-read": [("EIO", False)],
    "open-folder": [("EMFILE", False)],
    "make-folder": [("ENOSPC", False)],
    "unlink": [("EIO", False)],
    "truncate": [("EIO", False)],
}
NO_FAILURES = {("write", "short", False), ("read", "short", False), ("flush-folder", "EOPNOTSUPP", False),
               ("open-folder", "EMFILE", False)}


CHART = ["chart", "scene.toml", "-o", "out/chart", "--quick", "--resume", "--width", "4", "--reference-spp", "2", "--methods", "volume"]


def chart_with_a_gap(shop, states):
    """A chart of which one run is to be made again."""
    done = shop.folder(copy_of=states.state(states.all_but("picture")))
    shop.must_run(CHART, done)
    runs = done / "out" / "chart" / "runs"
    key = min(path.name for path in runs.glob("*-full.png")).removesuffix("-full.png")
    for path in runs.glob(key + "*"):
        path.unlink()
    return done


def prepared_jobs(shop):
    """Every stage writes in one job, so that each write is hit once; and the chunks that may lie in partial folders."""
    states = States(shop)
    state, all_but = states.state, states.all_but
    jobs = [
        Job("synth", ["synth", "fabric.toml"], state([])),
        Job("visibility", ["visibility", "fabric.toml"], state(["synth"])),
        Job("visibility --shard", ["visibility", "fabric.toml", "--shard", "1/1"], state(["synth"])),
        Job("transfer", ["transfer", "fabric.toml"], state(["synth"])),
        Job("transfer --shard", ["transfer", "fabric.toml", "--shard", "1/1"], state(["synth"])),
        Job("pack", ["pack", "fabric.toml"], state(all_but("voxelize", "pack", "picture"))),
        Job("precompute -o, new", PACK, state(all_but("picture"))),
        Job("precompute -o, over an old pack", PACK, state(all_but("picture"), old_outputs=True)),
        Job("run", PICTURES, state(all_but("picture"), old_outputs=True)),
        Job("run, all built", PICTURES, state(states.stages, old_outputs=True)),
        Job("render", PICTURE, state(all_but("picture"), old_outputs=True)),
        Job("chart", CHART, chart_with_a_gap(shop, states)),
        Job("compare", ["compare", "out/picture.exr", "out/scene.exr", "-o", "out/scene-difference.exr"],
            state([], old_outputs=True)),
    ]
    for job in jobs:
        job.run_undisturbed(shop)
    return jobs, {name: value for job in jobs for name, value in job.after.items() if ".partial/" in name}


def faults_of(job):
    counts = collections.Counter(kind for kind, _, _ in job.calls)
    for kind, errors in FAULTS.items():
        for error, lasting in errors:
            most = MOST_HARMLESS if kind in HARMLESS or job.name == "chart" else MOST
            for number in workshop.even_sample(counts[kind], most):
                yield Fault(kind, number, error, lasting)


def may_stay(fault, name):
    """What could not be removed, or listed for it, may stay."""
    return fault.kind in ("unlink", "open-folder") and (is_temporary(name) or ".partial" in name)


def unreadable(outcome, job):
    """Whether the first try to read a file of the cache failed."""
    if not outcome.failed:
        return False
    kind, number, path = outcome.failed[0]
    return kind in ("read", "open-read") and path.startswith("cache/") and path in job.before and not any(
        call[2] == path and call[0] == kind and call[1] < number for call in outcome.calls)


def reads_an_input(outcome):
    """A picture that a library reads for `compare`: its name is enough."""
    return any(kind in ("read", "open-read") and path.startswith("out/") for kind, _, path in outcome.failed if not is_temporary(path))


def hides_what_is_replaced(outcome, job):
    """Whether it kept the program from seeing what lies where an output goes."""
    return any(kind == "open-folder" and path + "/manifest.json" in job.before for kind, _, path in outcome.failed)


def check_fault(shop, job, fault, chunks):
    case = shop.folder(copy_of=job.state)
    outcome = shop.run(job.arguments, case, fault)

    def what_is_there():
        return {name: value for name, value in tree(case).items() if name in job.after or not may_stay(fault, name)}

    found = what_is_there()
    problems = ended_by_signal(outcome) + old_or_new(found, job, chunks) + temporaries(found)
    row_failed = job.name == "chart" and ": failed: " in outcome.error  # which a chart says, and goes on
    if row_failed:
        problems += [] if fault.reason() in outcome.error else ["the message lacks the reason: " + fault.reason()]
    elif outcome.status == 0:
        problems += differences(found, job.after, "exit status 0, but")
    else:
        problems += says_why(outcome, reason=not reads_an_input(outcome))
        if fault.error == "EIO" and unreadable(outcome, job):
            problems.append("an artifact that cannot be read was not built again")
        if (fault.kind, fault.error, fault.lasting) in NO_FAILURES and not hides_what_is_replaced(outcome, job):
            problems.append("this is no failure")
    if outcome.status != 0 or row_failed or problems:
        again = shop.run(job.arguments, case)
        if again.status != 0:
            problems += ["the same command once more fails:"] + again.text()
        left = what_is_there()
        problems += differences(left, job.after, "once more") + temporaries(left)
    shutil.rmtree(case)
    return problems and problems + outcome.text()


def main():
    with workshop.Workshop(__doc__) as shop:
        jobs, chunks = prepared_jobs(shop)
        cases = []
        for job in jobs:
            faults = list(faults_of(job))
            cases += [(job, fault) for fault in faults]
            counts = collections.Counter(kind for kind, _, _ in job.calls)
            print(f"{job.name}: {len(faults)} faults; calls: " + ", ".join(f"{n} {kind}" for kind, n in counts.items()))

        def check(case):
            job, fault = case
            group = f"{job.name}: {fault.kind}, {fault.error}{', lasting' if fault.lasting else ''}"
            return group, str(fault), check_fault(shop, job, fault, chunks)

        shop.for_each(cases, check)
        return shop.finish()


if __name__ == "__main__":
    sys.exit(main())
