"""What the fault tests share: a fabric of 16 segments and its scene, runs of the program with faults in them,
folders compared byte by byte, and the report.

A test is a script `PART.py --program heddle --preload libfault_injection.so`. It makes cases, each in a folder of its own with a
cache (`cache/`) and outputs (`out/`), runs them on all cores, and holds each against the laws. It ends with a table and status
1 where a law was broken. What a case does follows from a fixed seed.
"""

import argparse
import concurrent.futures
import dataclasses
import errno
import hashlib
import json
import os
import pathlib
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import traceback

FABRIC = """name = "tiny"
light_from = "face"
segment_um = 350
[weave]
notation = "plain"
repeats_x = 1
repeats_y = 1
crimp_warp = 0.5
[fiber.thread]
radius_um = 20
scattering = "white-isotropic"
[warp]
fiber = "thread"
spacing_mm = 0.5
width_mm = 0.3
height_mm = 0.2
plies = 1
fibers_per_ply = 1
yarn_twist_per_m = 0
ply_twist_per_m = 400
migration = 0
wander_rms_deg = 3
[weft]
fiber = "thread"
spacing_mm = 0.5
width_mm = 0.3
height_mm = 0.2
plies = 1
fibers_per_ply = 1
yarn_twist_per_m = 0
ply_twist_per_m = 400
migration = 0
wander_rms_deg = 3
[visibility]
components = 2
pca_segments = 8
sg_count = 4
[transfer]
order = 1
cell_mean_free_paths = 20
min_paths = 1024
max_paths = 1024
cones = "off"
[volume]
voxels_per_radius = 0.5
"""

# Its lights need everything that a pack can hold, so that `precompute` and `render` share one pack.
SCENE = """name = "swatch"
[camera]
position_mm = [0.1, -0.5, 1.0]
look_at_mm = [0, 0, 0]
fov_deg = 25
fov_axis = "vertical"
resolution_px = [6, 4]
[camera.reference]
corner_px = [1, 1]
size_px = [3, 2]
spp = 2
[[light]]
type = "directional"
direction = [0.3, 0.2, 1]
irradiance = [3, 3, 3]
[[light]]
type = "sg"
axis = [-0.5, 0.4, 1]
sharpness = 15
irradiance = [1, 1, 1]
[[cloth]]
flat_mm = [4, 4]
fabric = "fabric.toml"
[render]
method = "volume"
spp = 2
"""


PACK = ["precompute", "fabric.toml", "-o", "out/cloth.pack"]
PICTURE = ["render", "scene.toml", "-o", "out/picture.exr"]
PICTURES = ["run", "scene.toml", "-o", "out"]


@dataclasses.dataclass(frozen=True)
class Fault:
    """The number-th call of a kind (fault_injection.c) fails. error: an errno by its name, "short" or "kill"."""

    kind: str
    number: int
    error: str
    lasting: bool = False

    def __str__(self):
        return f"{self.kind} number {self.number}{' and all after it' if self.lasting else ''}: {self.error}"

    def reason(self):
        name = "ENOSPC" if self.error == "short" else self.error
        return os.strerror(getattr(errno, name))

    def environment(self):
        number = str(getattr(errno, self.error)) if self.error.startswith("E") else self.error
        variables = {"KIND": self.kind, "NUMBER": str(self.number), "ERROR": number}
        if self.lasting:
            variables["LASTING"] = "1"
        return {"HEDDLE_FAULT_" + name: value for name, value in variables.items()}


@dataclasses.dataclass
class Outcome:
    """How a run of the program ended."""

    command: list
    fault: Fault | None
    status: int  # negative: the signal that ended it
    out: str
    error: str
    calls: list  # (kind, number, path below the case) of every call that counted
    failed: list  # (kind, number, path) of those made to fail
    seconds: float

    def text(self):
        lines = ["command: " + " ".join(self.command), f"status:  {self.status}"]
        if self.fault:
            where = ", ".join(path for _, _, path in self.failed[:1]) or "never reached"
            lines.insert(1, f"fault:   {self.fault}, at {where}")
        return lines + ["stderr:  " + line for line in self.error.strip().splitlines()[-4:]]


class Workshop:
    """The program, the inputs, and a scratch folder that goes away."""

    def __init__(self, description):
        parser = argparse.ArgumentParser(description=description)
        parser.add_argument("--program", type=pathlib.Path, required=True, help="heddle")
        parser.add_argument("--preload", type=pathlib.Path, required=True, help="the library of fault_injection.c")
        self.options = parser.parse_args()
        self.program = self.options.program.resolve()
        self.preload = self.options.preload.resolve()
        self.workers = len(os.sched_getaffinity(0))
        self.start = time.monotonic()
        self.report = Report()
        self._counter = 0

    def __enter__(self):
        # Memory where there is enough of it: the disk's own speed is not what is tested.
        place = "/dev/shm" if shutil.disk_usage("/dev/shm").free > 1 << 30 else None
        self.root = pathlib.Path(tempfile.mkdtemp(prefix="heddle-faults-", dir=place)).resolve()
        self.inputs = self.root / "inputs"
        self.inputs.mkdir()
        (self.inputs / "fabric.toml").write_text(FABRIC)
        (self.inputs / "scene.toml").write_text(SCENE)
        return self

    def __exit__(self, *_):
        shutil.rmtree(self.root, ignore_errors=True)

    def finish(self):
        """Prints the report; the exit status of the test."""
        return self.report.finish(time.monotonic() - self.start)

    def folder(self, name="case", copy_of=None):
        """A new folder, empty or a copy."""
        self._counter += 1
        folder = self.root / f"{name}-{self._counter}"
        if copy_of is None:
            (folder / "out").mkdir(parents=True)
        else:
            shutil.copytree(copy_of, folder, symlinks=True)
        return folder

    def command(self, arguments):
        """The command line: names of inputs become paths; one thread, and the case's cache."""
        line = [str(self.program)]
        for argument in arguments:
            path = self.inputs / argument
            line.append(str(path) if path.is_file() else argument)
        if arguments[0] not in ("compare", "info", "check"):
            line += ["--cache", "cache", "-j", "1"]
        return line

    def start_program(self, line, case, environment=None):
        variables = {**os.environ, "ASAN_OPTIONS": "verify_asan_link_order=0", **(environment or {})}
        return subprocess.Popen(line, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                env=variables, cwd=case, text=True, errors="replace")

    def run(self, arguments, case, fault=None, watch=False, timeout=60, below="."):
        """Runs in the case's folder, to the end. watch: notes the calls that count, too. below: the folder on which they count."""
        line = self.command(arguments)
        environment = {}
        log = case.with_name(case.name + ".calls")
        if fault or watch:
            log.unlink(missing_ok=True)
            environment = {"LD_PRELOAD": str(self.preload), "HEDDLE_FAULT_FOLDER": str(case / below), "HEDDLE_FAULT_LOG": str(log)}
            if fault:
                environment.update(fault.environment())
        start = time.monotonic()
        process = self.start_program(line, case, environment)
        try:
            out, error = process.communicate(timeout=timeout)
        except subprocess.TimeoutExpired:
            process.kill()
            out, error = process.communicate()
            error += f"\nthe test killed it after {timeout} s\n"
        calls, failed = read_calls(log, case) if environment else ([], [])
        return Outcome(line, fault, process.returncode, out, error, calls, failed, time.monotonic() - start)

    def must_run(self, arguments, case, **more):
        """A run without which the test makes no sense."""
        outcome = self.run(arguments, case, **more)
        if outcome.status != 0:
            sys.exit("\n".join(["an undisturbed run failed"] + outcome.text()))
        return outcome

    def for_each(self, cases, check):
        """check(case) -> (group, title, problems) for all cases, on all cores; the report keeps the order of the cases."""
        def guarded(case):
            try:
                return check(case)
            except Exception:  # a law that could not be checked is a law broken
                return "error in the test itself", str(case), traceback.format_exc().splitlines()

        with concurrent.futures.ThreadPoolExecutor(self.workers) as pool:
            for group, title, problems in pool.map(guarded, cases):
                self.report.add(group, title, problems)


def read_calls(log, folder):
    calls, failed = [], []
    if log.exists():
        for line in log.read_text(errors="replace").splitlines():
            kind, number, path = line.removeprefix("FAULT ").split(" ", 2)
            call = (kind, int(number), os.path.relpath(path, folder))
            calls.append(call)
            if line.startswith("FAULT "):
                failed.append(call)
        log.unlink()
    return calls, failed


def processor_seconds():
    own, children = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return own.ru_utime + own.ru_stime + children.ru_utime + children.ru_stime


class Report:
    """Cases by groups, and what was wrong with those that failed."""

    SHOWN = 3  # failures of a group that are printed in full

    def __init__(self):
        self.tried = {}
        self.failed = {}

    def add(self, group, title, problems):
        self.tried[group] = self.tried.get(group, 0) + 1
        if problems:
            self.failed.setdefault(group, []).append((title, problems))

    def finish(self, seconds):
        for group, failures in self.failed.items():
            for title, problems in failures[:self.SHOWN]:
                print(f"\nFAILED  {group}: {title}")
                for line in problems:
                    print("    " + line)
        width = max(map(len, self.tried), default=0)
        print(f"\n{'':{width}}  tried  failed")
        for group, tried in self.tried.items():
            print(f"{group:{width}}  {tried:5}  {len(self.failed.get(group, [])):6}")
        tried, failed = sum(self.tried.values()), sum(map(len, self.failed.values()))
        print(f"{tried} cases, {failed} failed, {seconds:.1f} s, {processor_seconds():.1f} s of processor time")
        return 1 if failed else 0


@dataclasses.dataclass
class Job:
    """A command on a prepared folder, and what it leaves undisturbed."""

    name: str
    arguments: list
    state: object  # the folder that a case starts from
    before: dict = None  # tree of it
    after: dict = None  # tree of what an undisturbed run makes of it
    calls: list = None  # that the undisturbed run makes
    seconds: float = 0  # that it took

    def run_undisturbed(self, shop):
        case = shop.folder(copy_of=self.state)
        self.before = tree(case)
        outcome = shop.must_run(self.arguments, case, watch=True)
        self.calls, self.seconds = outcome.calls, outcome.seconds
        self.after = tree(case)
        shutil.rmtree(case)
        return self


class States:
    """Folders that cases start from: parts of a cache in which all is built, and outputs that are old or not there."""

    def __init__(self, shop):
        self.shop = shop
        self.full = shop.folder("full")
        shop.must_run(PACK, self.full)
        shop.must_run(PICTURES, self.full)
        self.stages = sorted(folder.name for folder in (self.full / "cache").iterdir())
        # Old outputs differ from the new ones.
        self.old = shop.folder("old")
        shop.must_run(PACK + ["--seed", "5"], self.old)
        shop.must_run(PICTURE + ["--seed", "5", "--spp", "4"], self.old)
        shop.must_run(PICTURES + ["--seed", "5"], self.old)

    def state(self, stages, old_outputs=False):
        """A folder with the artifacts of these stages."""
        folder = self.shop.folder("state")
        if old_outputs:
            shutil.copytree(self.old / "out", folder / "out", dirs_exist_ok=True)
        (folder / "cache").mkdir()
        for stage in stages:
            shutil.copytree(self.full / "cache" / stage, folder / "cache" / stage)
        return folder

    def all_but(self, *missing):
        return [stage for stage in self.stages if stage not in missing]


def fullest_first(path):
    """Sorts files of one name, those in the fuller folder first: all commands read the full pack, path tracing alone the other."""
    return -len(list(path.parent.iterdir())), path


def even_sample(count, most):
    """Numbers from 1 to count, the first and the last among them."""
    if count <= most:
        return list(range(1, count + 1))
    return sorted({1 + round(k * (count - 1) / (most - 1)) for k in range(most)})


# ---- file systems of our own


def may_mount():
    """Starts the script again where it may mount without anyone else seeing it. False where the system does not permit that."""
    if "HEDDLE_OWN_MOUNTS" in os.environ:
        return True
    for unshare in (["unshare", "--mount"], ["unshare", "--user", "--map-root-user", "--mount"]):
        trial = 'mount -t tmpfs -o size=64k tmpfs "$0" && umount "$0"'
        with tempfile.TemporaryDirectory() as folder:
            if subprocess.run([*unshare, "sh", "-c", trial, folder], capture_output=True).returncode != 0:
                continue
        os.environ["HEDDLE_OWN_MOUNTS"] = "1"
        sys.stdout.flush()
        os.execvp("unshare", [*unshare, sys.executable, "-u", *sys.argv])
    return False


def mount(folder, options):
    """An empty file system in memory at this folder, or other options for the one that is there."""
    subprocess.run(["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(folder)], check=True, capture_output=True)


def unmount(folder):
    subprocess.run(["umount", "--lazy", str(folder)], check=True, capture_output=True)


# ---- folders compared


def is_temporary(name):
    """Part of a path of something that is not finished."""
    return any(part.startswith(".") or ".tmp" in part for part in pathlib.PurePath(name).parts)


def without_timings(value):
    """A JSON value without what differs from run to run: times, and the checksums of files that hold some."""
    if isinstance(value, dict):
        return {key: without_timings(entry) for key, entry in value.items()
                if "seconds" not in key and key not in ("costs", "threads", "seal", "picture.json")}
    return [without_timings(entry) for entry in value] if isinstance(value, list) else value


# What each page of a chart ends with; all of them show timings.
CHART_PAGES = {"chart.csv": b"\n", "chart.json": b"}\n", "chart.svg": b"</svg>\n", "chart-local.svg": b"</svg>\n", "index.html": b"</html>\n"}


def content(path):
    """What is to be the same, undisturbed or not: bytes, but for the timings in JSON and in charts."""
    if path.is_symlink():
        return "link to " + os.readlink(path)
    if path.is_dir():
        return "folder"
    data = path.read_bytes()
    if path.name in CHART_PAGES:
        return "page" if data.endswith(CHART_PAGES[path.name]) else f"broken page of {len(data)} bytes"
    if path.suffix == ".json" and path.name != "manifest.json":
        try:
            return "json " + json.dumps(without_timings(json.loads(data)), sort_keys=True)
        except ValueError:
            return f"broken json of {len(data)} bytes"
    return f"{len(data)} bytes, {hashlib.sha256(data).hexdigest()[:16]}"


def tree(folder):
    """{path relative to the folder: content}."""
    found = {}
    for place, folders, files in os.walk(folder):
        for name in folders + files:
            path = pathlib.Path(place) / name
            found[str(path.relative_to(folder))] = content(path)
    return found


def below(files, folder):
    """The part of a tree below one of its folders."""
    return {name: value for name, value in files.items() if name.startswith(folder + "/")}


def differences(found, expected, what):
    """Lines that say where two trees differ."""
    lines = []
    for name in sorted(found.keys() | expected.keys()):
        left, right = found.get(name, "not there"), expected.get(name, "not there")
        if left != right:
            lines.append(f"{what}: {name}: {left[:100]}; expected: {right[:100]}")
    return lines[:6] + ([f"{what}: and {len(lines) - 6} more"] if len(lines) > 6 else [])


def temporaries(found):
    return [f"left behind: {name}" for name in found if is_temporary(name)]


# ---- laws of single runs


def whole_folders(*trees):
    """Packs and cached pictures in any of the trees."""
    return {name.rpartition("/")[0] for files in trees for name in files if not is_temporary(name)
            if name.endswith("/manifest.json") or name.startswith("cache/picture/") and name.endswith("/picture.json")}


def old_or_new(found, job, chunks):
    """What is neither the old state nor the new one."""
    problems = []
    for name, value in found.items():
        known = (job.before.get(name), job.after.get(name), chunks.get(name))
        if not is_temporary(name) and value != "folder" and value not in known:
            problems.append(f"neither old nor new: {name}: {value[:100]}")
    for folder in whole_folders(job.before, job.after, found):
        if below(found, folder) not in (below(job.before, folder), below(job.after, folder)):
            problems.append(f"as a whole neither the old one nor the new one: {folder}")
    return problems


def ended_by_signal(outcome):
    if outcome.status >= 0:
        return []
    return [f"ended by signal {signal.Signals(-outcome.status).name}"]


def named_folder(path):
    """Where a message has to point for a fault at this path: a temporary file's target lies in the same folder."""
    place = pathlib.PurePath()
    for part in pathlib.PurePath(path).parts:
        if is_temporary(part) or part.endswith(".partial"):
            return str(place) + "/"
        place = place / part
    return str(place)


def says_why(outcome, reason=True):
    """A run that failed by a fault names the file and the system's reason."""
    last = "\n".join(outcome.error.strip().splitlines())
    problems = []
    if "heddle: " not in last:
        problems.append("no message on standard error")
    if outcome.fault and outcome.failed:
        if reason and outcome.fault.reason() not in last:
            problems.append(f"the message lacks the reason: {outcome.fault.reason()}")
        if not any(named_folder(path) in last for _, _, path in outcome.failed):
            problems.append(f"the message names no file at {named_folder(outcome.failed[0][2])}")
    return problems
