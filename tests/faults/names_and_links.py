"""Targets with the longest legal names, without a folder in front, and targets that are symbolic links.

Laws: a name of 250 bytes is a name like any other. A link stays, and the file or folder that it points to is replaced; one that points
to nothing gets its target. A folder that is not a pack, and what a user has put into one, is not lost.
"""

import os
import shutil
import sys

import workshop
from workshop import PACK, PICTURE, PICTURES, States, content, is_temporary, tree

LONGEST = 250  # bytes


def long_name(suffix, longest_suffix=None):
    """A name of which that with the longest suffix has 250 bytes; ä takes two."""
    room = LONGEST - len(longest_suffix or suffix)
    return "ä" * (room // 2) + "x" * (room % 2) + suffix


class Links:
    """A case with all in the cache, and the outputs to expect."""

    def __init__(self, shop):
        self.shop = shop
        states = States(shop)
        self.old = states.old / "out"
        self.state = states.state(states.stages)
        new = shop.folder(copy_of=self.state)
        for arguments in (PACK, PICTURE, PICTURES):
            shop.must_run(arguments, new)
        shop.must_run(["compare", "out/picture.exr", "out/scene.exr", "-o", "out/compared.exr"], new)
        self.new = tree(new / "out")

    def case(self):
        return self.shop.folder(copy_of=self.state)

    def run(self, title, arguments, case, expected):
        """expected: {path of the case: name of the output whose content it has, or the content itself}."""
        outcome = self.shop.run(arguments, case)
        problems = []
        if outcome.status != 0:
            problems.append("it fails")
        for name, want in expected.items():
            found = content(case / name) if os.path.lexists(case / name) else "not there"
            if found != self.new.get(want, want):
                problems.append(f"{name[-60:]}: {found[:80]}; expected: {self.new.get(want, want)[:80]}")
        problems += [f"left behind: {name}" for name in tree(case) if is_temporary(name)]
        self.shop.report.add(title.split(":")[0], title, problems and problems + outcome.text())
        shutil.rmtree(case)

    def pack_files(self, folder):
        return {name.replace("cloth.pack", folder): name for name in self.new if name.startswith("cloth.pack/")}


def longest_names(links):
    title = "names of 250 bytes: "
    stem = long_name("", ".json")
    triple = {f"out/{stem}{suffix}": f"picture{suffix}" for suffix in (".exr", ".png", ".json")}
    links.run(title + "a picture", PICTURE[:-1] + [f"out/{stem}.exr"], links.case(), triple)
    folder = long_name(".pack")
    links.run(title + "a pack", PACK[:-1] + [f"out/{folder}"], links.case(), links.pack_files(f"out/{folder}"))
    case = links.case()
    shutil.copytree(links.old / "cloth.pack", case / "out" / folder)
    links.run(title + "a pack over an old one", PACK[:-1] + [f"out/{folder}"], case, links.pack_files(f"out/{folder}"))
    case = links.case()
    (case / "out").rename(case / folder)
    links.run(title + "the folder of pictures", ["run", "scene.toml", "-o", folder], case,
              {f"{folder}/scene{suffix}": f"scene{suffix}" for suffix in (".exr", ".png")})
    case = links.case()
    links.shop.must_run(PICTURE, case)
    links.shop.must_run(PICTURES, case)
    links.run(title + "a difference", ["compare", "out/picture.exr", "out/scene.exr", "-o", f"out/{long_name('.exr')}"], case,
              {f"out/{long_name('.exr')}": "compared.exr"})


def working_folder(links):
    title = "no folder in front: "
    links.run(title + "a picture", PICTURE[:-1] + ["picture.exr"], links.case(),
              {f"picture{suffix}": f"picture{suffix}" for suffix in (".exr", ".png", ".json")})
    links.run(title + "a pack", PACK[:-1] + ["cloth.pack"], links.case(), links.pack_files("cloth.pack"))
    case = links.case()
    shutil.copytree(links.old / "cloth.pack", case / "cloth.pack")
    links.run(title + "a pack over an old one, with a slash behind", PACK[:-1] + ["cloth.pack/"], case, links.pack_files("cloth.pack"))
    links.run(title + "pictures", PICTURES[:-1] + ["."], links.case(), {"scene.exr": "scene.exr", "scene-reference.exr": "scene-reference.exr"})


def linked_files(links):
    title = "links to files: "
    suffixes = (".exr", ".png", ".json")
    for dangling in (False, True):
        for relative in (False, True):
            case = links.case()
            (case / "elsewhere").mkdir()
            expected = {}
            for suffix in suffixes:
                target = case / "elsewhere" / f"real{suffix}"
                if not dangling:
                    shutil.copy(links.old / f"picture{suffix}", target)
                (case / "out" / f"picture{suffix}").symlink_to(f"../elsewhere/real{suffix}" if relative else target)
                expected |= {f"elsewhere/real{suffix}": f"picture{suffix}",
                             f"out/picture{suffix}": "link to " + os.readlink(case / "out" / f"picture{suffix}")}
            kind = f"{'relative' if relative else 'absolute'}, {'to nothing yet' if dangling else 'to an old file'}"
            links.run(title + kind, PICTURE, case, expected)
    case = links.case()
    (case / "elsewhere").mkdir()
    shutil.copy(links.old / "picture.exr", case / "elsewhere" / "real.exr")
    (case / "elsewhere" / "second.exr").symlink_to("real.exr")
    (case / "out" / "picture.exr").symlink_to("../elsewhere/second.exr")
    links.run(title + "a link to a link", PICTURE, case,
              {"elsewhere/real.exr": "picture.exr", "elsewhere/second.exr": "link to real.exr",
               "out/picture.exr": "link to ../elsewhere/second.exr"})


def linked_folders(links):
    title = "links to folders: "
    for before in ("an old pack", "an empty folder", "nothing yet"):
        case = links.case()
        (case / "elsewhere").mkdir()
        if before == "an old pack":
            shutil.copytree(links.old / "cloth.pack", case / "elsewhere" / "real.pack")
        elif before == "an empty folder":
            (case / "elsewhere" / "real.pack").mkdir()
        (case / "out" / "cloth.pack").symlink_to("../elsewhere/real.pack")
        links.run(title + f"a pack, to {before}", PACK, case,
                  {**links.pack_files("elsewhere/real.pack"), "out/cloth.pack": "link to ../elsewhere/real.pack"})
    case = links.case()
    (case / "elsewhere").mkdir()
    (case / "out").rmdir()
    (case / "out").symlink_to("elsewhere")
    links.run(title + "the folder of pictures", PICTURES, case, {"elsewhere/scene.exr": "scene.exr", "out": "link to elsewhere"})
    case = links.case()
    (case / "cache").rename(case / "real-cache")
    (case / "cache").symlink_to("real-cache")
    shutil.rmtree(case / "real-cache" / "pack")
    links.run(title + "the cache", PACK, case, {**links.pack_files("out/cloth.pack"), "cache": "link to real-cache"})


def foreign_targets(links):
    """What is there is neither an old output nor nothing: refused with a message, or kept."""
    def refused(title, case, precious):
        before = {name: content(case / name) for name in precious}
        arguments = PICTURE if "picture" in title else PACK
        outcome = links.shop.run(arguments, case)
        problems = [f"lost or changed: {name}" for name, value in before.items()
                    if not (case / name).exists() or content(case / name) != value]
        problems += [f"left behind: {name}" for name in tree(case) if is_temporary(name)]
        if outcome.status != 0 and "heddle: " not in outcome.error:
            problems.append("no message on standard error")
        links.shop.report.add("targets that are something else", title, problems and problems + outcome.text())
        shutil.rmtree(case)

    case = links.case()
    (case / "out" / "cloth.pack").mkdir()
    (case / "out" / "cloth.pack" / "thesis.txt").write_text("years of work")
    refused("a pack over a folder that is none", case, ["out/cloth.pack/thesis.txt"])
    case = links.case()
    shutil.copytree(links.old / "cloth.pack", case / "out" / "cloth.pack")
    (case / "out" / "cloth.pack" / "notes.txt").write_text("of this pack")
    refused("a pack over an old one in which a user keeps notes", case, ["out/cloth.pack/notes.txt"])
    case = links.case()
    (case / "out" / "cloth.pack").write_text("a file")
    refused("a pack over a file", case, ["out/cloth.pack"])
    case = links.case()
    (case / "out" / "picture.exr").mkdir()
    (case / "out" / "picture.exr" / "thesis.txt").write_text("years of work")
    refused("a picture over a folder", case, ["out/picture.exr/thesis.txt"])


def main():
    with workshop.Workshop(__doc__) as shop:
        links = Links(shop)
        longest_names(links)
        working_folder(links)
        linked_files(links)
        linked_folders(links)
        foreign_targets(links)
        return shop.finish()


if __name__ == "__main__":
    sys.exit(main())
