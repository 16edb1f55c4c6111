"""A cache that cannot be written, with everything in it that is needed: `run`, `render` and the stages work.

Leftovers and broken artifacts in such a cache cannot be mended: leftovers are passed over; a broken artifact gives the right bytes or
an error that names it. The cache is read-only by a mount where that is permitted, and always by calls that fail with EROFS.
"""

import os
import shutil
import sys

import workshop
from workshop import PACK, PICTURE, PICTURES, Fault, States, differences, ended_by_signal, is_temporary, tree

COMMANDS = [PACK, PICTURE, PICTURES, ["synth", "fabric.toml"], ["visibility", "fabric.toml"], ["transfer", "fabric.toml"]]


class Mounted:
    """The cache on a file system that is mounted read-only."""

    name = "mounted read-only"

    def __init__(self, shop):
        self.shop = shop

    def run(self, arguments, case):
        sound = case / "sound-cache"
        (case / "cache").rename(sound)
        (case / "cache").mkdir()
        workshop.mount(case / "cache", "size=16m")
        shutil.copytree(sound, case / "cache", dirs_exist_ok=True)
        shutil.rmtree(sound)
        workshop.mount(case / "cache", "remount,ro")
        outcome = self.shop.run(arguments, case)
        found = tree(case)
        workshop.unmount(case / "cache")
        return outcome, found


class Injected:
    """Every call that would change something in the cache fails."""

    name = "EROFS for every change"

    def __init__(self, shop):
        self.shop = shop

    def run(self, arguments, case):
        return self.shop.run(arguments, case, Fault("change", 1, "EROFS"), below="cache"), tree(case)


def check(shop, way, arguments, state, expected, may_fail):
    case = shop.folder(copy_of=state)
    before = {name: value for name, value in tree(case).items() if name.startswith("cache/")}
    outcome, found = way.run(arguments, case)
    problems = ended_by_signal(outcome)
    problems += differences({name: value for name, value in found.items() if name.startswith("cache/")}, before, "the cache")
    outputs = {name: value for name, value in found.items() if name.startswith("out/")}
    if outcome.status == 0:
        problems += differences(outputs, expected, "outputs")
    elif not may_fail:
        problems.append("it fails")
    elif "heddle: " not in outcome.error or "cache/" not in outcome.error:
        problems.append("the message names no file of the cache")
    problems += [f"left behind: {name}" for name in outputs if is_temporary(name)]
    shutil.rmtree(case)
    return problems and problems + outcome.text()


def main():
    ways = [Mounted, Injected] if workshop.may_mount() else [Injected]
    with workshop.Workshop(__doc__) as shop:
        if Mounted not in ways:
            print("mounting is not permitted here: only by injected faults")
        states = States(shop)
        full = states.state(states.stages)
        leftovers = shop.folder(copy_of=full)
        for stage in (leftovers / "cache").iterdir():
            (stage / ".heddle-0123abcd-2147483647-0.tmp").write_bytes(b"half a file")
        cases = []
        for arguments in COMMANDS:
            case = shop.folder(copy_of=full)
            shop.must_run(arguments, case)
            expected = {name: value for name, value in tree(case).items() if name.startswith("out/")}
            for way in ways:
                cases += [(way(shop), "everything built", arguments, full, expected, False),
                          (way(shop), "leftovers in it", arguments, leftovers, expected, False)]
        for arguments, stage in ((PACK, "pack"), (PICTURE, "pack"), (PICTURES, "picture"), (PICTURES, "pack")):
            broken = shop.folder(copy_of=full)
            for path in (broken / "cache" / stage).rglob("*"):
                if path.suffix in (".safetensors", ".exr"):
                    os.truncate(path, path.stat().st_size // 2)
            case = shop.folder(copy_of=full)
            shop.must_run(arguments, case)
            expected = {name: value for name, value in tree(case).items() if name.startswith("out/")}
            cases += [(way(shop), f"broken {stage}", arguments, broken, expected, True) for way in ways]

        def check_case(case):
            way, title, arguments, *rest = case
            return f"{way.name}: {title}", " ".join(arguments), check(shop, way, arguments, *rest)

        shop.for_each(cases, check_case)
        return shop.finish()


if __name__ == "__main__":
    sys.exit(main())
