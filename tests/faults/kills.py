"""kill -9 at random moments, and before every call that changes a folder; then the same command again.

Laws: right after a kill each file under its final name, and each pack as a whole, is the old one or the new one; the same command
again succeeds and leaves the same bytes as a run that nobody killed, and nothing else: no temporary file or folder, no chunks.
"""

import random
import shutil
import signal
import subprocess
import sys
import time

import workshop
from workshop import PACK, PICTURE, PICTURES, Fault, Job, States, differences, old_or_new, temporaries, tree

KILLS = 100  # at random moments
BEFORE_CALLS = 5  # of each kind of call of each job
CHANGES = ("write", "rename", "open-write", "make-folder", "unlink")


def prepared_jobs(shop):
    states = States(shop)
    jobs = [
        Job("precompute, cold cache", PACK, states.state([], old_outputs=True)),
        Job("precompute, pack missing", PACK, states.state(states.all_but("voxelize", "pack", "picture"), old_outputs=True)),
        Job("run", PICTURES, states.state(states.all_but("picture"), old_outputs=True)),
        Job("render", PICTURE, states.state(states.all_but("pack", "picture"), old_outputs=True)),
    ]
    for job in jobs:
        job.run_undisturbed(shop)
    shards = Job("chunks", ["transfer", "fabric.toml", "--shard", "1/1"], states.state(["synth"])).run_undisturbed(shop).after
    shards |= Job("chunks", ["visibility", "fabric.toml", "--shard", "1/1"], states.state(["synth"])).run_undisturbed(shop).after
    return jobs, {name: value for name, value in shards.items() if ".partial/" in name}


def kill_at(shop, job, case, seconds):
    """Kills the command so long after its start. False where it had ended by then."""
    process = shop.start_program(shop.command(job.arguments), case)
    time.sleep(seconds)
    process.send_signal(signal.SIGKILL)
    process.communicate()
    return process.returncode == -signal.SIGKILL


def after_a_kill(shop, job, case, chunks):
    """What is wrong right after a kill, and after the same command once more."""
    problems = old_or_new(tree(case), job, chunks)
    again = shop.run(job.arguments, case)
    if again.status != 0:
        problems += ["the same command once more fails:"] + again.text()
    left = tree(case)
    problems += differences(left, job.after, "once more") + temporaries(left)
    return problems and problems + again.text()


def killed_in_time(shop, job, share, start_up, chunks):
    """Killed when this share of the time after the start-up is over; sooner where that was too late."""
    seconds = start_up + share * (job.seconds - start_up)
    while True:
        case = shop.folder(copy_of=job.state)
        killed = kill_at(shop, job, case, seconds)
        if killed:
            problems = after_a_kill(shop, job, case, chunks)
        shutil.rmtree(case)
        if killed:
            return f"{job.name}: at a random moment", f"killed {1e3 * seconds:.0f} ms after the start", problems
        seconds *= 0.8


def killed_before_a_call(shop, job, fault, chunks):
    case = shop.folder(copy_of=job.state)
    outcome = shop.run(job.arguments, case, fault)
    problems = after_a_kill(shop, job, case, chunks)
    if not outcome.failed and outcome.status != 0:
        problems = ["not killed, yet it failed"] + outcome.text() + problems
    shutil.rmtree(case)
    where = outcome.failed[0][2] if outcome.failed else "never reached"
    return f"{job.name}: before a {fault.kind}", f"{fault}, at {where}", problems


def main():
    with workshop.Workshop(__doc__) as shop:
        jobs, chunks = prepared_jobs(shop)
        start_up = min(timed(shop) for _ in range(3))
        chance = random.Random(12)
        moments = [(job, chance.random()) for job in jobs for _ in range(KILLS // len(jobs))]
        shop.for_each(moments, lambda moment: killed_in_time(shop, *moment, start_up, chunks))
        calls = []
        for job in jobs:
            for kind in CHANGES:
                count = sum(call[0] == kind for call in job.calls)
                numbers = workshop.even_sample(count, BEFORE_CALLS)
                calls += [(job, Fault(kind, number, "kill")) for number in numbers]
                if count:
                    print(f"{job.name}: killed before {len(numbers)} of {count} calls of the kind {kind}")
        shop.for_each(calls, lambda call: killed_before_a_call(shop, *call, chunks))
        return shop.finish()


def timed(shop):
    """Seconds that the program takes to start."""
    start = time.monotonic()
    subprocess.run([str(shop.program), "--version"], stdout=subprocess.DEVNULL, check=True)
    return time.monotonic() - start


if __name__ == "__main__":
    sys.exit(main())
