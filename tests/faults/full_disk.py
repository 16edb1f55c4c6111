"""Disks that are really full (small file systems in memory, where mounting is permitted), and folders that cannot be flushed.

Each command runs with room for so many more pages of 4 KiB. Laws as for injected faults: status 0 only with all
outputs there and right, else a message with the reason; old outputs stay; and with room again the same command gives the same
bytes as an undisturbed run. A full standard output is an error, too.
"""

import errno
import os
import shutil
import subprocess
import sys

import workshop
from workshop import (PACK, PICTURE, PICTURES, Fault, Job, States, differences, ended_by_signal, old_or_new, temporaries,
                      tree)

PAGE = 4096
FREE_PAGES = [0, 1, 2, 3, 4, 5, 6, 8, 11, 16, 24, 36, 52, 54, 56, 58, 64, 80]


def prepared_jobs(states):
    everything = states.all_but("picture")
    return [
        Job("a volume and a pack", ["pack", "fabric.toml"], states.state(states.all_but("voxelize", "pack", "picture"))),
        Job("a picture over an old one", PICTURE, states.state(everything, old_outputs=True)),
        Job("pictures over old ones", PICTURES, states.state(everything, old_outputs=True)),
        Job("precompute -o, new", PACK, states.state(everything)),
        Job("precompute -o, over an old pack", PACK, states.state(everything, old_outputs=True)),
    ]


def used_bytes(folder):
    disk = os.statvfs(folder)
    return (disk.f_blocks - disk.f_bfree) * disk.f_frsize


def check_room(shop, job, pages):
    case = shop.folder()
    workshop.mount(case, "size=64m")
    shutil.copytree(job.state, case, symlinks=True, dirs_exist_ok=True)
    workshop.mount(case, f"remount,size={used_bytes(case) + pages * PAGE}")
    outcome = shop.run(job.arguments, case)
    found = tree(case)
    problems = ended_by_signal(outcome) + old_or_new(found, job, {}) + temporaries(found)
    if outcome.status == 0:
        problems += differences(found, job.after, "exit status 0, but")
    elif os.strerror(errno.ENOSPC) not in outcome.error:
        problems.append("the message lacks the reason: " + os.strerror(errno.ENOSPC))
    if outcome.status != 0 or problems:
        workshop.mount(case, "remount,size=64m")
        again = shop.run(job.arguments, case)
        if again.status != 0:
            problems += ["with room again it fails:"] + again.text()
        left = tree(case)
        problems += differences(left, job.after, "with room again") + temporaries(left)
    workshop.unmount(case)
    return f"full disk: {job.name}", f"room for {pages} pages", problems and problems + outcome.text()


def folders_not_flushed(shop, jobs):
    """File systems that cannot flush folders say so by different names."""
    cases = [(job, error) for job in jobs for error in ("EOPNOTSUPP", "EINVAL", "EIO", "ENOSYS")]

    def check(case):
        job, error = case
        folder = shop.folder(copy_of=job.state)
        outcome = shop.run(job.arguments, folder, Fault("flush-folder", 1, error, lasting=True))
        problems = [] if outcome.status == 0 else ["it fails"]
        problems += differences(tree(folder), job.after, "afterwards")
        shutil.rmtree(folder)
        return "folders that cannot be flushed", f"{job.name}: {error}", problems and problems + outcome.text()

    shop.for_each(cases, check)


def full_standard_output(shop, jobs):
    for job in jobs:
        case = shop.folder(copy_of=job.state)
        with open("/dev/full", "w") as full:
            outcome = subprocess.run(shop.command(job.arguments), cwd=case, stdout=full, stderr=subprocess.PIPE, text=True)
        problems = [] if outcome.returncode == 1 and "heddle: " in outcome.stderr else [f"status: {outcome.returncode}"]
        shop.report.add("standard output to a full disk", job.name, problems)


def main():
    mounting = workshop.may_mount()
    with workshop.Workshop(__doc__) as shop:
        jobs = [job.run_undisturbed(shop) for job in prepared_jobs(States(shop))]
        if mounting:
            disks = [(job, pages) for job in jobs for pages in FREE_PAGES]
            shop.for_each(disks, lambda disk: check_room(shop, *disk))
        else:
            print("mounting is not permitted here: full disks only by injected faults (injected_faults.py)")
        folders_not_flushed(shop, jobs)
        full_standard_output(shop, jobs)
        return shop.finish()


if __name__ == "__main__":
    sys.exit(main())
