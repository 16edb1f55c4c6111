"""Twenty processes at once on one cache, five rounds and one with broken artifacts.

Laws: every process succeeds; all outputs and the whole cache are the same bytes as those of a single process; nothing is left
behind. What a process left that is no more goes away; what belongs to one that lives, or may live on another machine, stays.
"""

import os
import shutil
import subprocess
import sys
import time

import workshop
from workshop import PACK, PICTURE, PICTURES, Fault, States, differences, fullest_first, is_temporary, temporaries, tree

PROCESSES = 20
DAY = 24 * 3600  # s


def own_output(arguments, number):
    """The same command with an output of its own."""
    return [argument.replace("out/", f"out/{number}-") if argument != "out" else f"out/{number}" for argument in arguments]


def damaged(folder):
    """Breaks one artifact of each stage: a changed byte in the middle, or half the file."""
    for k, stage in enumerate(sorted((folder / "cache").iterdir())):
        files = sorted((path for path in stage.rglob("*") if path.suffix in (".safetensors", ".vdb", ".exr")), key=fullest_first)
        data = bytearray(files[0].read_bytes())
        data[len(data) // 2] ^= 0x10
        files[0].write_bytes(data[:len(data) // 2] if k % 2 else data)


def all_at_once(shop, title, commands, state, expected):
    """Starts the commands together. `expected`: the tree that they leave."""
    case = shop.folder(copy_of=state)
    running = [(arguments, shop.start_program(shop.command(arguments), case)) for arguments in commands]
    for number, (arguments, process) in enumerate(running, 1):
        _, error = process.communicate(timeout=300)
        problems = []
        if process.returncode != 0:
            problems = [f"status:  {process.returncode}"] + ["stderr:  " + line for line in error.strip().splitlines()[-4:]]
        shop.report.add(title, f"process {number}: {' '.join(arguments)}", problems)
    found = tree(case)
    problems = differences(found, expected, "after all of them") + temporaries(found)
    shop.report.add(f"{title}: what is there afterwards", "cache and outputs", problems)
    shutil.rmtree(case)


def left_by_one(shop, commands, state):
    """The tree that single processes leave, one after the other."""
    case = shop.folder(copy_of=state)
    for arguments in commands:
        shop.must_run(arguments, case)
    expected = tree(case)
    shutil.rmtree(case)
    return expected


def dead_process():
    """The number of a process that is no more."""
    process = subprocess.Popen(["true"])
    process.wait()
    return process.pid


def leftovers_go(shop, states):
    """Files and folders as a killed process leaves them, in every folder that a command writes to."""
    case = shop.folder(copy_of=states.state(states.all_but("voxelize", "pack", "picture"), old_outputs=True))
    machine = name_of_this_machine(shop, states)
    other = f"{int(machine, 16) ^ 1:08x}"
    dead, alive = dead_process(), os.getpid()
    stay = []
    (case / "cache" / "voxelize").mkdir()
    for folder in (case / "out", case / "cache" / "voxelize"):
        half = folder / f".heddle-{machine}-{dead}-1.tmp"
        half.mkdir()
        (half / "fibers.safetensors").write_bytes(b"half a pack")
        (folder / f".heddle-{machine}-{dead}-0.tmp").write_bytes(b"half a file")
        forgotten = folder / f".heddle-{other}-{alive}-0.tmp"
        forgotten.write_bytes(b"half a file")
        os.utime(forgotten, (time.time() - 2 * DAY,) * 2)
        for name in (f".heddle-{machine}-{alive}-0.tmp", f".heddle-{other}-{dead}-0.tmp", ".heddle-notes.tmp",
                     f".heddle-{machine}-{dead}-0.tmp.txt"):
            (folder / name).write_bytes(b"not yours")
            stay.append(folder / name)
    problems = []
    for arguments in (PACK, PICTURES):
        outcome = shop.run(arguments, case)
        if outcome.status != 0:
            problems += outcome.text()
    for path in stay:
        if not path.is_file() or path.read_bytes() != b"not yours":
            problems.append(f"gone, though nobody died: {path.relative_to(case)}")
        path.unlink(missing_ok=True)
    problems += temporaries(tree(case))
    shop.report.add("leftovers", "of dead processes go, all else stays", problems)


def name_of_this_machine(shop, states):
    """As temporary names hold it: .heddle-MACHINE-PROCESS-NUMBER.tmp."""
    case = shop.folder(copy_of=states.state([]))
    shop.run(["synth", "fabric.toml"], case, Fault("write", 1, "kill"))
    return next(name.split("/")[-1].split("-")[1] for name in tree(case) if is_temporary(name))


def main():
    with workshop.Workshop(__doc__) as shop:
        states = States(shop)
        cold = states.state([])
        mixed = [PACK, PICTURE, PICTURES]

        def own(*commands):
            return [own_output(commands[k % len(commands)], k) for k in range(PROCESSES)]

        def same(*commands):
            return [commands[k % len(commands)] for k in range(PROCESSES)]

        rounds = [
            ("precompute, cold cache", own(PACK), cold),
            ("render, cold cache", own(PICTURE), cold),
            ("precompute, render, run, cold cache", own(*mixed), cold),
            ("the same outputs, cold cache", same(*mixed), cold),
            ("the same outputs, over old ones", same(*mixed), states.state(states.all_but("pack", "picture"), old_outputs=True)),
        ]
        for title, commands, state in rounds:
            distinct = [arguments for k, arguments in enumerate(commands) if arguments not in commands[:k]]
            all_at_once(shop, title, commands, state, left_by_one(shop, distinct, state))

        full = states.state(states.stages)
        broken = shop.folder(copy_of=full)
        damaged(broken)
        commands = own(*mixed)
        all_at_once(shop, "broken artifacts of every stage", commands, broken, left_by_one(shop, commands, full))
        leftovers_go(shop, states)
        return shop.finish()


if __name__ == "__main__":
    sys.exit(main())
