"""Bits flipped, files cut, emptied, zeroed, replaced by a folder or gone: in every artifact, record and chunk of a cache.

Laws: the command that reads the file succeeds and leaves the same outputs and artifacts as with a sound cache. Where the file was
built again, standard error named it. Where it was left as it is, nothing depended on what had changed in it.
`info` and `check` of broken files end with status 0 or 1 and a message, never by a signal, and `check` finds every flip.
"""

import collections
import random
import shutil
import sys

import workshop
from workshop import PACK, PICTURES, States, content, differences, ended_by_signal, fullest_first, temporaries, tree

FLIPS = 4  # of each file that a command reads
INFO_FLIPS = 6  # of each kind of file that `info` is shown
VOLUME_CHANGES = 200  # of bytes of a bare volume
CHECK_FLIPS = 2  # of each file of a pack

# Thread with data that are computed once, for the two stages of surface fabrics.
SURFACE = """model = "microcylinder"
[[thread]]
albedo = [0.1, 0.2, 0.3]
direction = 1
gamma_s_deg = 60
gamma_v_deg = 60
ior = 1.5
kd = 0.5
lengths = [1]
offsets_deg = [0, 0]
share = 1
"""
MESH = "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n"
SURFACE_SCENE = """name = "surface"
[camera]
position_mm = [0.1, -0.5, 1.0]
look_at_mm = [0, 0, 0]
fov_deg = 25
fov_axis = "vertical"
resolution_px = [4, 4]
spp = 1
[[light]]
type = "directional"
direction = [0.3, 0.2, 1]
irradiance = [3, 3, 3]
[[cloth]]
mesh = "triangle.obj"
mesh_unit = "mm"
uv_size_mm = 1
surface = "thread.toml"
surface_method = "interactive"
"""


def flipped(data, chance, count):
    """Copies with one changed bit each: in the first bytes, the last ones, and anywhere."""
    places = [chance.randrange(8), len(data) - 1 - chance.randrange(min(8, len(data))), chance.randrange(min(256, len(data)))]
    places += [chance.randrange(len(data)) for _ in range(count)]
    for place in places[:count]:
        changed = bytearray(data)
        changed[place] ^= 1 << chance.randrange(8)
        yield f"bit flipped in byte {place} of {len(data)}", bytes(changed)


def broken_versions(data, chance, flips):
    """(what was done, the bytes instead; None: gone; "folder": a folder)."""
    yield from flipped(data, chance, flips)
    yield "cut in the middle", data[:len(data) // 2]
    yield "one byte more", data + b"x"
    yield "empty", b""
    yield "second half zeroed", data[:len(data) // 2] + bytes(len(data) - len(data) // 2)
    yield "gone", None
    yield "a folder", "folder"


def break_file(path, instead):
    path.unlink()
    if instead == "folder":
        path.mkdir()
        (path / "file").write_bytes(b"not an artifact")
    elif instead is not None:
        path.write_bytes(instead)


class Broken:
    """One file of a prepared folder, broken in one way, and the command that reads it."""

    def __init__(self, arguments, state, expected, name, how, instead):
        self.arguments, self.state, self.expected = arguments, state, expected
        self.name, self.how, self.instead = name, how, instead

    def group(self):
        """Stage and kind of file; keys are of no interest."""
        _, stage, *folders, file = self.name.split("/")
        if folders and not folders[0].endswith(".partial"):
            return f"{stage} {file}"
        return f"{stage}{' chunk' if folders else ''} {file.split('.', 1)[1]}"


def check_broken(shop, broken, noticed):
    case = shop.folder(copy_of=broken.state)
    path = case / broken.name
    break_file(path, broken.instead)
    left = content(path) if path.exists() else None
    outcome = shop.run(broken.arguments, case)
    found = tree(case)
    expected = broken.expected
    problems = ended_by_signal(outcome)
    if outcome.status != 0:
        problems.append("it fails")
    if path.name in outcome.error:
        noticed["named"] += 1
    elif broken.instead is None:
        noticed["gone"] += 1
    elif found.get(broken.name) == left:
        noticed["left as it was"] += 1
        expected = {**expected, broken.name: left}
        found.pop(broken.name + "/file", None)
    elif broken.name in found:
        problems.append("built again, but not named on standard error")
    problems += differences(found, expected, "afterwards") + temporaries(found)
    shutil.rmtree(case)
    return problems and problems + outcome.text()


def readers(shop, states):
    """(command, prepared folder, its stages whose files are broken): each file is read by the command."""
    pack = ["precompute", "fabric.toml"]
    shards = shop.folder(copy_of=states.state(["synth"]))
    shop.must_run(["visibility", "fabric.toml", "--shard", "1/1"], shards)
    shop.must_run(["transfer", "fabric.toml", "--shard", "1/1"], shards)
    surface = shop.folder()
    draw = ["render", "surface.toml", "-o", "out/surface.exr"]
    shop.must_run(draw, surface)
    return [
        (pack, states.state(states.all_but("voxelize", "pack")), ["synth", "ssdf", "sg", "transfer"]),
        (pack, states.state(states.all_but("ssdf", "pack")), ["maps"]),
        (pack, states.state(states.all_but("pack")), ["voxelize"]),
        (PACK, states.state(states.stages), ["pack"]),
        (PICTURES, states.state(states.stages), ["picture"]),
        (["visibility", "fabric.toml"], shards, ["maps"]),
        (["transfer", "fabric.toml"], shards, ["transfer"]),
        (draw, surface, ["surface-weights", "surface-maps"]),
    ]


def first_of_each_kind(stage):
    """Two packs, or two pictures, are written and read alike. Of two files of one size, the one in the fuller pack."""
    kinds = {}
    for path in sorted(stage.rglob("*"), key=lambda path: (-path.stat().st_size, *fullest_first(path))):
        if path.is_file():
            in_folder = path.name if path.parent != stage and path.parent.suffix != ".partial" else ""
            kinds.setdefault((in_folder, "".join(path.suffixes), path.parent.suffix), path)
    return kinds.values()


def broken_artifacts(shop, states, chance):
    for arguments, state, stages in readers(shop, states):
        case = shop.folder(copy_of=state)
        shop.must_run(arguments, case)
        expected = tree(case)
        shutil.rmtree(case)
        for stage in stages:
            for path in first_of_each_kind(state / "cache" / stage):
                slow = stage == "surface-weights"  # a second to build
                versions = list(broken_versions(path.read_bytes(), chance, 1 if slow else FLIPS))
                record = path.name.endswith(".record.json")
                for how, instead in versions[::3] if slow else versions[::2] if record else versions:
                    yield Broken(arguments, state, expected, str(path.relative_to(state)), how, instead)


def changed_volumes(data, chance):
    """Copies of a volume with one other byte each, every second one in the first kilobyte: the header, and how the tree goes on."""
    for number in range(VOLUME_CHANGES):
        place = chance.randrange(1024 if number % 2 else len(data))
        changed = bytearray(data)
        changed[place] ^= 1 + chance.randrange(255)
        yield f"byte {place} of {len(data)}: {data[place]} made {changed[place]}", bytes(changed)


def info_of_broken_files(shop, states, chance):
    """`info` of one file of each kind; of a bare volume more often, as its library trusts what it reads."""
    kinds = {}
    for path in sorted((states.full / "cache").rglob("*")):
        if path.is_file() and not path.name.endswith((".record.json", ".png")) and "pack/" not in str(path):
            kinds.setdefault((path.parent.name, "".join(path.suffixes)), path)
    folder = shop.folder("info")
    for (stage, suffix), path in kinds.items():
        versions = list(broken_versions(path.read_bytes(), chance, INFO_FLIPS))
        if suffix == ".vdb":
            versions += changed_volumes(path.read_bytes(), chance)
        for number, (how, instead) in enumerate(versions):
            if isinstance(instead, bytes):
                file = folder / f"{stage}-{number}{suffix}"
                file.write_bytes(instead)
                yield f"info: {stage}{suffix}", how, ["info", str(file)], (0, 1)


def check_of_broken_packs(shop, states, chance):
    pack = next(path.parent for path in (states.full / "cache" / "pack").glob("*/volume.vdb"))
    for file in sorted(pack.iterdir()):
        for how, instead in broken_versions(file.read_bytes(), chance, CHECK_FLIPS):
            copy = shop.folder("pack", copy_of=pack)
            break_file(copy / file.name, instead)
            yield f"check: {file.name}", how, ["check", str(copy)], (1,)


def check_status(shop, arguments, statuses):
    outcome = shop.run(arguments, shop.root, timeout=20)
    problems = ended_by_signal(outcome)
    if outcome.status not in statuses:
        problems.append(f"status {outcome.status}, expected {' or '.join(map(str, statuses))}")
    if outcome.status == 1 and "heddle: " not in outcome.error:
        problems.append("no message on standard error")
    return problems and problems + outcome.text()


def main():
    with workshop.Workshop(__doc__) as shop:
        for name, text in (("thread.toml", SURFACE), ("triangle.obj", MESH), ("surface.toml", SURFACE_SCENE)):
            (shop.inputs / name).write_text(text)
        states = States(shop)
        chance = random.Random(3)
        noticed = collections.Counter()
        cases = list(broken_artifacts(shop, states, chance))
        shop.for_each(cases, lambda case: (case.group(), f"{case.name}: {case.how}", check_broken(shop, case, noticed)))
        print("broken files: " + ", ".join(f"{count} {what}" for what, count in noticed.items()))
        shown = list(info_of_broken_files(shop, states, chance)) + list(check_of_broken_packs(shop, states, chance))
        shop.for_each(shown, lambda case: (case[0], case[1], check_status(shop, *case[2:])))
        return shop.finish()


if __name__ == "__main__":
    sys.exit(main())
