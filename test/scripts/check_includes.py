#!/usr/bin/env python3
"""Checks who includes whom: packages, libraries without ROS, the rooms of a package (its folders of sources), and circles.
Checks too that sources of one folder, which are compiled together, give no name twice in their unnamed namespaces.

Prints every forbidden include and name and exits with 1 where there is one. --levels prints the height of the include graph."""
import argparse
import re
import sys
from collections import defaultdict
from pathlib import Path

# A package includes headers of itself and of these.
PACKAGES = {
    "mmradartwin_msgs": set(),
    "mmradartwin_dsp": {"mmradartwin_msgs"},
    "mmradartwin_driver": {"mmradartwin_dsp", "mmradartwin_msgs"},
    "mmradartwin_sim": {"mmradartwin_dsp", "mmradartwin_msgs"},
    "mmradartwin_attribution": {"mmradartwin_dsp", "mmradartwin_msgs", "mmradartwin_sim"},
}

# Headers of ROS: not for include/ and src/ of a package, but for their folders ros/ and for nodes/.
ROS_HEADERS = re.compile(
    r"^(ros|rosbag|roscpp|rosconsole|nodelet|pluginlib|actionlib|diagnostic_updater|message_filters|topic_tools|tf|tf2\w*"
    r"|\w+_msgs|std_srvs)/|(^|/)ros/")

# Rooms of a folder and the rooms that each may include, with all that those may include; a room sees no other. Files
# beside the rooms see all and are seen by none, rooms.h apart, which tells the compiler the same of the namespaces.
ROOMS = {
    "mmradartwin_sim/src": {
        "scene": set(),
        "mesh": {"scene"},
        "records": {"mesh"},
        "rays": {"records"},
        "physics": {"rays"},
        "corners": {"physics"},
        "edges": {"corners"},
        "echoes": {"edges"},
        "stages": {"echoes"},
        "mechanisms": {"stages"},
        "twin": {"stages"},
        "what_if": {"twin"},
        "room": {"rays"},
        "scan": {"rays"},
        "scan_quality": {"scan"},
        "ros": {"twin", "room"},
    },
    "mmradartwin_sim/src/mechanisms": {
        "base": set(),
        "scene": {"base"},
        "mounting": {"base"},
        "propagation": {"base"},
        "array": {"base"},
        "receiver": {"base"},
        "frames": {"base"},
        "empirical": {"base"},
    },
    "mmradartwin_sim/src/scan": {
        "samples": set(),
        "planes": {"samples"},
        "things": {"planes"},
        "objects": {"things"},
    },
    "mmradartwin_attribution/src/diagnosis": {
        "catalogue": set(),
        "numbers": {"catalogue"},
        "frames": {"catalogue"},
        "channels": {"numbers", "frames"},
        "echoes": {"channels"},
        "likelihood": {"echoes"},
        "hypotheses": {"likelihood"},
        "fit": {"hypotheses"},
        "receiver": {"fit"},
        "search": {"fit"},
        "gain": {"fit"},
        "rounds": {"receiver", "search", "gain"},
        "report": {"catalogue"},
    },
}

# Folders of public headers that have no source there.
HEADERS_WITHOUT_SOURCE = {
    "mmradartwin_sim/include/mmradartwin_sim/mechanism.h": "mmradartwin_sim/src/stages",
    "mmradartwin_sim/include/mmradartwin_sim/mechanism_stages.h": "mmradartwin_sim/src/stages",
    "mmradartwin_sim/include/mmradartwin_sim/register_mechanism.h": "mmradartwin_sim/src/stages",
    "mmradartwin_sim/include/mmradartwin_sim/scan_to_scene.h": "mmradartwin_sim/src/scan/samples",
    "mmradartwin_sim/include/mmradartwin_sim/what_if_entry.h": "mmradartwin_sim/src/what_if",
}

INCLUDE = re.compile(r'^\s*#\s*include\s*["<]([^">]+)[">]', re.MULTILINE)
TOP = ""  # the room of files beside the rooms


def all_below(arrows):
    """The rooms that each room may include, through others too."""
    def below(room, seen):
        for other in arrows.get(room, ()):
            if other not in seen:
                seen.add(other)
                below(other, seen)
        return seen
    return {room: below(room, set()) for room in arrows}


def without_dots(parts):
    kept = []
    for part in parts:
        if part == ".." and kept:
            kept.pop()
        elif part != ".":
            kept.append(part)
    return kept


class Sources:
    """C++ files of the packages below a folder, and what they include of each other."""

    def __init__(self, root):
        self.root = Path(root)
        self.includes = {}  # path from the root: names as written
        for package in PACKAGES:
            for part in ("include", "src", "apps", "nodes", "python", "emulator", "benchmark", "test"):
                for file in sorted((self.root / package / part).rglob("*")):
                    if file.suffix in (".h", ".cpp"):
                        text = file.read_text(encoding="utf-8")
                        self.includes[file.relative_to(self.root).as_posix()] = INCLUDE.findall(text)

    def resolve(self, file, name):
        """The file that an include means, None for one of another project."""
        package = file.split("/")[0]
        for folder in (Path(file).parent, Path(package, "src"), *(Path(other, "include") for other in PACKAGES)):
            path = Path(*without_dots((folder / name).parts)).as_posix()
            if path in self.includes:
                return path
        return None

    def arrows(self):
        """(file, included file) of all includes among the packages."""
        for file, names in self.includes.items():
            for name in names:
                target = self.resolve(file, name)
                if target and target != file:
                    yield file, target

    def unit(self, file):
        """Header and source of one name are one unit, that of the source where it has one."""
        package, stem = file.split("/")[0], Path(file).stem
        if file in HEADERS_WITHOUT_SOURCE:
            return f"{HEADERS_WITHOUT_SOURCE[file]}/{stem}"
        if file.startswith(f"{package}/include/"):
            ros = "/ros/" in file
            for source in self.includes:
                if source.startswith(f"{package}/src/") and Path(source).stem == stem and ("/ros/" in source) == ros:
                    return source.rsplit(".", 1)[0]
        return file.rsplit(".", 1)[0]


    def arrows_of_code(self):
        """(unit, included unit) of all includes among the packages' libraries."""
        library = {file for file in self.includes if file.split("/")[1] in ("include", "src")}
        arrows = {(self.unit(a), self.unit(b)) for a, b in self.arrows() if a in library and b in library}
        return {(a, b) for a, b in arrows if a != b}


def check_packages(sources):
    for file, names in sources.includes.items():
        package, part = file.split("/")[:2]
        for name in names:
            other = name.split("/")[0]
            if other in PACKAGES and other != package and other not in PACKAGES[package]:
                yield f"{file}: includes {name}; {package} does not depend on {other}"
            elif part in ("include", "src") and "/ros/" not in file and ROS_HEADERS.search(name):
                yield f"{file}: includes {name}; the library is free of ROS, adapters stand in ros/ and nodes/"


def check_rooms(sources, folder, table):
    table = all_below(table)

    def room_of(file):
        """The room of a file, that of its source for a public header; None outside the folder."""
        unit = sources.unit(file)
        if not unit.startswith(folder + "/"):
            return None
        parts = unit[len(folder) + 1:].split("/")
        return parts[0] if len(parts) > 1 else TOP

    found = {room_of(file) for file in sources.includes} - {None, TOP}
    for room in sorted(found - set(table)):
        yield f"{folder}/{room}: is a room that the table does not have"
    for room in sorted(set(table) - found):
        yield f"{folder}/{room}: is in the table and has no files"
    if folder.endswith("/src"):
        for file in sorted(sources.includes):
            if file.startswith(folder[:-len("src")] + "include/") and room_of(file) is None:
                yield f"{file}: is a public header of no room; name its folder in HEADERS_WITHOUT_SOURCE"
    for file, target in sources.arrows():
        room, other = room_of(file), room_of(target)
        if not room or other is None or other == room or target == f"{folder}/rooms.h":
            continue
        if other == TOP or other not in table.get(room, ()):
            yield f"{file}: includes {target}; {room} may not see {other or 'the files beside the rooms'}"


def levels(units, arrows):
    """Height of each unit over those that include no other; units in a circle stand at one height."""
    below = defaultdict(set)
    for unit, other in arrows:
        below[unit].add(other)
    order, index, low, stack, circle = [], {}, {}, [], {}

    def visit(unit):  # Tarjan's strongly connected components
        index[unit] = low[unit] = len(index)
        stack.append(unit)
        for other in below[unit]:
            if other not in index:
                visit(other)
                low[unit] = min(low[unit], low[other])
            elif other not in circle:
                low[unit] = min(low[unit], index[other])
        if low[unit] == index[unit]:
            members = stack[stack.index(unit):]
            del stack[stack.index(unit):]
            order.append(members)
            circle.update({member: len(order) - 1 for member in members})

    sys.setrecursionlimit(10000)
    for unit in units:
        if unit not in index:
            visit(unit)
    height = {}
    for members in order:
        lower = {height[other] for member in members for other in below[member] if circle[other] != circle[member]}
        for member in members:
            height[member] = 1 + max(lower, default=0)
    return height, [members for members in order if len(members) > 1]


def check_circles(sources):
    arrows = sources.arrows_of_code()
    _, circles = levels(sorted({unit for arrow in arrows for unit in arrow}), arrows)
    for circle in circles:
        yield f"{min(circle)}: includes itself in a circle of {', '.join(sorted(circle))}"


UNNAMED = re.compile(r"^namespace \{\n(.*?)^\}  // namespace$", re.MULTILINE | re.DOTALL)
# In an unnamed namespace, at the start of a line: a type; constants; a function.
NAMES = [re.compile(r"^(?:struct|class|enum class|enum) (\w+)"), re.compile(r"\b(k[A-Z]\w*)(?:\[\w*\])* ?[={]"),
         re.compile(r"^[\w:].*?[ &*>](\w+)\(")]


def unnamed_names(text):
    """Names that the source's unnamed namespaces define, as far as lines tell."""
    lines = [line.split("//")[0] for block in UNNAMED.findall(text) for line in block.splitlines()]
    return {name for line in lines if re.match(r"(?!namespace |template|static_assert|using )[A-Za-z_]", line)
            for pattern in NAMES for name in pattern.findall(line)}


def check_names(sources):
    """A function of the same name in another source would be an overload, and could be called in silence."""
    folders = defaultdict(lambda: defaultdict(list))
    for file in sources.includes:
        if file.endswith(".cpp") and file.split("/")[1] in ("src", "emulator"):
            for name in unnamed_names((sources.root / file).read_text(encoding="utf-8")):
                folders[file.rsplit("/", 1)[0]][name].append(file)
    for names in folders.values():
        for name, files in sorted(names.items()):
            if len(files) > 1:
                yield f"{files[1]}: {name} is a name in {files[0]} too, and both are compiled together"


def check(sources):
    problems = list(check_packages(sources))
    for folder, table in ROOMS.items():
        problems += check_rooms(sources, folder, table)
    return problems + list(check_circles(sources)) + list(check_names(sources))


def print_levels(sources):
    parts = [f"{package}/{part}/" for package in PACKAGES for part in ("include", "src")]
    code = [file for file in sources.includes if file.startswith(tuple(parts))]
    folders = [*PACKAGES, *ROOMS]
    all_arrows = sources.arrows_of_code()
    print("folder  units  levels  arrows  circles")
    for folder in folders:
        units = sorted({sources.unit(file) for file in code if sources.unit(file).startswith(folder + "/")})
        inside = set(units)
        arrows = {(a, b) for a, b in all_arrows if a in inside and b in inside}
        height, circles = levels(units, arrows)
        print(f"{folder}  {len(units)}  {max(height.values(), default=0)}  {len(arrows)}  {len(circles)}")
        for circle in circles:
            print("  circle: " + ", ".join(unit[len(folder) + 1:] for unit in sorted(circle)))
        if folder in ROOMS:
            table = ROOMS[folder]
            arrows = {(room, other) for room, below in table.items() for other in below}
            height, _ = levels(sorted(table), arrows)
            for level in sorted(set(height.values())):
                print(f"  rooms at {level}: " + ", ".join(room for room in table if height[room] == level))


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("root", nargs="?", default=Path(__file__).resolve().parents[2], help="the repository")
    parser.add_argument("--levels", action="store_true", help="print the height of the include graph and stop")
    arguments = parser.parse_args()
    sources = Sources(arguments.root)
    if arguments.levels:
        print_levels(sources)
        return 0
    problems = check(sources)
    print("\n".join(problems) if problems else f"includes: {len(sources.includes)} files, nothing forbidden")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
