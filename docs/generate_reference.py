#!/usr/bin/env python3
"""Writes the generated pages of docs/reference from the programs' help and the sources.

Run it in the sourced workspace: python3 docs/generate_reference.py. With --check it writes nothing and says which pages
are out of date."""
import argparse
import math
import os
import re
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

ROOT = Path(__file__).resolve().parents[1]
REFERENCE = ROOT / "docs/reference"
NOTE = "<!-- Written by docs/generate_reference.py from the sources: change those, and run it again. -->\n\n"
PACKAGES = ["mmradartwin_dsp", "mmradartwin_driver", "mmradartwin_sim", "mmradartwin_attribution"]
MAIN = re.compile(r"^int main\(", re.M)


def fail(text):
    sys.exit(f"error: {text}")


def read(path):
    return Path(path).read_text(encoding="utf-8")


# ---- C++ calls, as far as the sources of this project write them

def calls(text, name):
    """Arguments of every call whose function's name matches the pattern: (name, [argument, ...], place)."""
    for match in re.finditer(rf"({name})\(", text):
        depth, quoted, argument, found = 1, False, "", []
        position = match.end()
        while depth and position < len(text):
            c = text[position]
            if quoted:
                quoted = c != '"' or text[position - 1] == "\\"
            elif c == '"':
                quoted = True
            elif c in "([{":
                depth += 1
            elif c in ")]}":
                depth -= 1
            if depth == 0 or (c == "," and depth == 1 and not quoted):
                found.append(" ".join(argument.split()))
                argument = ""
            else:
                argument += c
            position += 1
        yield match.group(1), found, match.start()


def string(argument):
    """The text of adjacent string literals, or None where the argument is none."""
    parts = re.findall(r'"((?:[^"\\]|\\.)*)"', argument)
    return "".join(parts).replace('\\"', '"') if parts and argument.startswith('"') else None


def number(argument):
    argument = argument.replace("std::string()", "")
    return {"1 << 20": "1048576", "0.0": "0", "true": "true", "false": "false"}.get(argument, re.sub(r"\.0$", "", argument))


def cell(text):
    return str(text).replace("|", "\\|").replace("\n", " ") or "–"


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(cell(c) for c in row) + " |" for row in rows]) + "\n"


# ---- programs

def prefixes():
    workspace = [ROOT / ".ws/devel", ROOT / ".ws/install"]
    return [Path(p) for p in os.environ.get("CMAKE_PREFIX_PATH", "").split(os.pathsep) if p] + workspace


def find_program(package, name):
    for prefix in prefixes():
        path = prefix / "lib" / package / name
        if os.access(path, os.X_OK):
            return path
    return fail(f"{package} {name} is not built; run ./run.sh build, then this in ./run.sh exec")


def help_of(package, name, seconds=300):
    """What `PROGRAM --help` prints, without paths of this machine; empty where it does not end."""
    path = find_program(package, name)
    environment = dict(os.environ, COLUMNS="100", ROS_MASTER_URI="http://127.0.0.1:9", LC_ALL="C.UTF-8")
    try:
        result = subprocess.run([path, "--help"], env=environment, capture_output=True, text=True, timeout=seconds,
                                check=False)
    except subprocess.TimeoutExpired:
        return ""
    text = result.stdout if result.returncode == 0 else ""
    text = re.sub(rf"(?:/[^\s/]+)+/({re.escape(name)})\b", r"\1", text)
    return "\n".join(line.rstrip() for line in text.strip().splitlines())


def offline_programs():
    """(package, name) of every program that is no node."""
    found = []
    for package in PACKAGES:
        names = [p.stem for p in sorted((ROOT / package / "apps").glob("*.cpp")) if MAIN.search(read(p))]
        found += [(package, name) for name in names]
    found.append(("mmradartwin_attribution", "request_diagnosis"))
    for cmake in sorted(ROOT.glob("*/CMakeLists.txt")):
        text = read(cmake)
        package = re.search(r"project\((\w+)", text).group(1)
        for block in re.findall(r"catkin_install_python\(PROGRAMS(.*?)DESTINATION", text, re.S):
            for script in block.split():
                if "argparse" in read(cmake.parent / script):
                    found.append((package, Path(script).name))
    return found


def programs_page():
    sections = []
    for package, name in offline_programs():
        text = help_of(package, name)
        if not text:
            fail(f"{package} {name} --help prints nothing")
        sections.append(f"## {name}\n\n`rosrun {package} {name}`\n\n```text\n{text}\n```\n")
    return "# Programs\n\n" + NOTE + (
        "Every program prints the text below with `--help`. Results go to standard output, notes and errors to standard\n"
        "error. The exit status is 0 when all is done, 2 for bad input or use (also where some poses were skipped and the\n"
        "rest was written), and 1 for any other failure.\n\n") + "\n".join(sections)


# ---- nodes

def node_programs():
    """(package, program, sources that read its parameters and make its topics)."""
    nodes = []
    for package in PACKAGES:
        for main in sorted((ROOT / package / "nodes").glob("*.cpp")):
            if not MAIN.search(read(main)) or main.stem == "request_diagnosis":
                continue
            headers = re.findall(rf'#include "{package}/(ros/\w+)\.h"', read(main))
            adapters = [ROOT / package / "src" / f"{header}.cpp" for header in headers]
            sources = [p for p in adapters if p.exists() and "StrictParameters parameters" in read(p)]
            nodes.append((package, main.stem, [main] + sources))
    return nodes


def constant(name, package):
    """Value that a member or constant is initialised with, where the sources give one."""
    leaf = re.split(r"\.|->", name)[-1]
    for folder in [package] + PACKAGES:
        for path in sorted((ROOT / folder).rglob("*.h")) + sorted((ROOT / folder / "nodes").glob("*.cpp")):
            for match in re.finditer(rf"\b{re.escape(leaf)} = ([^;,]+)[;,]", read(path)):
                if not re.search(r"parameters\.|[{}]", match.group(1)):
                    return match.group(1).strip()
    return ""


def default_of(argument, package):
    text = string(argument)
    if text is not None:
        return f"`{text}`" if text else "empty"
    value = number(argument)
    if re.fullmatch(r"[-+\d.e]+|true|false", value):
        return value
    value = constant(argument.split(" *")[0], package)
    if "* 180 / M_PI" in argument:
        in_degrees = value.endswith(" * M_PI / 180")
        value = value.removesuffix(" * M_PI / 180") if in_degrees else f"{math.degrees(float(value)):.3g}"
    return f"`{value.strip(chr(34))}`" if value.startswith('"') else number(value)


def parameters_of(sources, package):
    rows = []
    for source in sources:
        for kind, arguments, _ in calls(read(source), r"parameters\.(?:number|integer|boolean|text|requiredText)"):
            name, kind = string(arguments[0]), kind.split(".")[1]
            if name is None:
                continue
            if kind == "requiredText":
                rows.append([f"`{name}`", "text", f"must be given: {string(arguments[1])}", ""])
                continue
            limits = f"{number(arguments[2])} to {number(arguments[3])}" if kind in ("number", "integer") else ""
            rows.append([f"`{name}`", kind, default_of(arguments[1], package), limits])
    return rows


def node_help(package, program):
    """Sections of the node's --help, {title: [(name, what stands in brackets, meaning)]}; None where nodes have none yet."""
    if not (ROOT / "mmradartwin_dsp/include/mmradartwin_dsp/ros/node_program.h").exists():
        return None
    text = help_of(package, program)
    if "\nParameters:\n" not in text:
        fail(f"{package} {program} --help prints no parameters")
    return parse_node_help(text)


def parse_node_help(text):
    sections = {}
    for title, body in re.findall(r"^(\w+):\n((?:  .*\n?)+)", text, re.M):
        sections[title] = re.findall(r"^  (\S+) \((.*?)\): (.*)$", body, re.M)
    return sections


def launch_files():
    for path in sorted((ROOT / "launch").glob("*.launch")):
        rows = []
        for arg in ElementTree.parse(path).getroot().findall("arg"):
            if arg.get("value") is None:
                given = arg.get("default")
                default = "must be given" if given is None else f"`{given}`" if given else "empty"
                rows.append([f"`{arg.get('name')}`", default, arg.get("doc", "")])
        yield path.name, rows


def parameters_page():
    text = "# Parameters\n\n" + NOTE + (
        "Launch arguments are given as `name:=value` behind `roslaunch mmradartwin_launch FILE`. A node's private\n"
        "parameters are given as `_name:=value` behind `rosrun`, or by `<param>` in a launch file. An unknown name, a wrong\n"
        "type and a value out of range are errors; the node then ends with exit status 2.\n\n")
    for name, rows in launch_files():
        text += f"## {name}\n\n" + table(["argument", "default", "meaning"], rows) + "\n"
    for package, program, sources in node_programs():
        text += f"## {program}\n\nPackage `{package}`.\n\n"
        sections = node_help(package, program)
        if sections is None:
            text += table(["parameter", "type", "default", "allowed"], parameters_of(sources, package)) + "\n"
        else:
            rows = [[f"`{name}`", brackets, meaning] for name, brackets, meaning in sections["Parameters"]]
            text += (table(["parameter", "type, default, allowed", "meaning"], rows) if rows else "No parameters.\n") + "\n"
    return text


TOPICS = """# Topics, services and actions

{note}Names are relative unless they begin with `/`: a namespace moves them all; `~` stands for the node's name. The action
`attribution/diagnose` (`mmradartwin_msgs/Diagnose`) of `diagnosis_node` is made of topics below that name. Fields stand
in [messages](messages.md).

"""


def topics_of_help():
    text = ""
    for package, program, _ in node_programs():
        text += f"## {program}\n\n"
        sections = node_help(package, program)
        for title in ("Subscribes", "Publishes", "Services"):
            rows = [[f"`{name}`", f"`{kind}`", meaning] for name, kind, meaning in sections.get(title, [])]
            if rows:
                text += f"{title}:\n\n" + table(["name", "type", "meaning"], rows) + "\n"
    return text


def topics_of_sources():
    published, subscribed, services = set(), set(), set()
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.cpp")):
            if "/test/" in str(path):
                continue
            text, node = read(path), f"`{path.stem}`"
            for kind, arguments, _ in calls(text, r"advertise<[\w:]+>"):
                message = re.search(r"<([\w:]+)>", kind).group(1).replace("::", "/")
                latched = "yes" if len(arguments) > 2 and arguments[2] == "true" else ""
                if string(arguments[0]):
                    published.add((f"`{string(arguments[0])}`", f"`{message}`", node, latched))
            for _, arguments, _ in calls(text, r"subscribe(?:<[\w:]+>)?"):
                if arguments and string(arguments[0]):
                    subscribed.add((f"`{string(arguments[0])}`", node))
            for _, arguments, _ in calls(text, r"advertiseService"):
                if arguments and string(arguments[0]):
                    services.add((f"`{string(arguments[0])}`", node))
    return ("The column *source* is the source file that makes the topic: a node, or the part of it that is shared. *Latched* "
            "means that a late\nsubscriber still gets the last message.\n\n## Published\n\n"
            + table(["topic", "message", "source", "latched"], sorted(published))
            + "\n## Subscribed\n\n" + table(["topic", "source"], sorted(subscribed))
            + "\n## Services\n\n" + table(["service", "source"], sorted(services)))


def topics_page():
    has_help = (ROOT / "mmradartwin_dsp/include/mmradartwin_dsp/ros/node_program.h").exists()
    return TOPICS.format(note=NOTE) + (topics_of_help() if has_help else topics_of_sources())


def messages_page():
    text = "# Messages\n\n" + NOTE
    for kind, folder in (("Messages", "msg"), ("Services", "srv"), ("Actions", "action")):
        text += f"## {kind}\n\n"
        for path in sorted((ROOT / "mmradartwin_msgs" / folder).glob(f"*.{folder}")):
            text += f"### {path.stem}\n\n```text\n{read(path).strip()}\n```\n\n"
    return text


# ---- keys of YAML files

# Meanings that no comment beside the key's member gives. A key without a meaning is an error, so that none is forgotten.
MEANINGS = {
    "device": "name of the chip, e.g. awr2243; tells the byte layout where `layout` does not",
    "slope_hz_per_s": "slope of the ramp", "sample_rate_hz": "rate of the samples", "loops_per_frame": "repetitions of all slots",
    "frame_period_s": "from the start of one frame to that of the next",
    "radar: samples_per_chirp": "number N of samples of a chirp", "rx_position_m": "receivers, [x, y, z] in radar_link",
    "layout": "byte layout of captures", "iq_order": "which of I and Q stands first", "samples": "kind of samples in captures",
    "idle_s": "from the end of a ramp to the start of the next", "ramp_end_s": "from the start of a ramp to its end",
    "rx_gain_db": "gain of the receivers", "tx_backoff_db": "transmitters below their full power",
    "if_highpass_hz": "corners of the two high-pass filters behind the mixer",
    "rx_enable": "device's receiver numbers", "angle_slots": "slots that the angle transform takes; all without it",
    "format": "kind and version of the file", "radar": "path of radar.yaml", "scene": "path of scene.yaml",
    "twin": "path of twin.yaml", "poses": "path of poses.csv",
    "captures": "path of the captures; {pose} stands for the pose's name",
    "accuracy": "how good scene, levels and poses are, see below", "gain_db": "of a simulated session: gain of the samples",
    "facets": "how far triangles may deviate and still be one flat face", "angle_deg": "deviation of the normals",
    "offset_m": "deviation out of the plane", "materials": "path of materials.yaml",
    "meshes": "list of mesh files", "file": "path of the mesh", "xyz_m": "shift into map", "rpy_deg": "roll, pitch, yaw into map",
    "scale": "factor on the mesh", "up": "axis that is up in the file, where the file does not declare it",
    "unit": "unit of the file, where the file does not declare it", "origin": "taken off all coordinates first, metres",
    "actors": "overrides by actor: `{NAME: {material: TAG}}`", "material": "material tag of the actor",
    "model": "which law the material follows", "relative_permittivity": "real part",
    "conductivity_s_per_m": "conductivity at the radar's frequency", "roughness_rms_m": "rms height of the surface",
    "base_rcs_db": "reflection at normal incidence", "back_exp": "exponent of the backscatter lobe's power",
    "mix": "share of the reflection that falls off like the lobe", "diff_back_db": "diffuse backscatter; −90 or less is none",
    "norm_exp": "exponent of the projected area, 1 is Lambert's", "thickness_m": "thickness of the panel",
    "color": "for displays, [r, g, b]", "valid_hz": "band in which the constants hold, [lowest, highest]",
    "extrapolated": "true: the constants are used outside of the band",
    "mechanisms": "what the model is made of, see [mechanisms](mechanisms.md)",
    "materials: materials": "list of materials: `{TAG: {model: …}}`", "channels: gain_db": "gain error per virtual channel",
    "phase_deg": "phase error per virtual channel", "strong_db": "a cell from here on is strong",
    "medium_db": "a cell from here on is medium", "weak_db": "a cell below this is weak", "far_limit_m": "end of the middle band",
    "near_limit_m": "end of the near band", "tight": "half widths of the tight window", "wide": "half widths of the wide window",
    "agreement": "half widths within which two peaks are the same", "regions": "expected response regions, see the keys below",
    "range_m": "of a window: half width in range", "azimuth_deg": "of a window: half width in azimuth", "top_k": "three numbers K",
}

# File, sources that read it, headers whose comments explain its members.
YAML_FILES = [
    ("radar.yaml", ["mmradartwin_dsp/src/radar_reader.cpp"], ["mmradartwin_dsp/include/mmradartwin_dsp/radar_config.h"]),
    ("session.yaml", ["mmradartwin_dsp/src/session.cpp"], []),
    ("accuracy (in session.yaml and diagnosis.yaml)", ["mmradartwin_dsp/src/stated_accuracy.cpp"],
     ["mmradartwin_dsp/include/mmradartwin_dsp/stated_accuracy.h"]),
    ("scene.yaml", ["mmradartwin_sim/src/scene/scene.cpp"], []),
    ("materials.yaml", ["mmradartwin_sim/src/scene/material.cpp"], ["mmradartwin_sim/include/mmradartwin_sim/material.h"]),
    ("twin.yaml", ["mmradartwin_sim/src/twin/twin_description.cpp"], []),
    ("channels.yaml", ["mmradartwin_dsp/src/chain/channel_correction.cpp"], []),
    ("attribution.yaml", ["mmradartwin_attribution/src/attribution_config.cpp"],
     ["mmradartwin_attribution/include/mmradartwin_attribution/attribution_config.h"]),
]
KINDS = {"number": "number", "integer": "whole number", "boolean": "true or false", "text": "text", "choice": "text",
         "numbers": "list of numbers", "integers": "list of whole numbers", "texts": "list of texts", "rows": "list of [x, y, z]",
         "integerLists": "list of lists of whole numbers", "map": "mapping", "maps": "list of mappings",
         "readRadarNumber": "number", "readNumber": "number", "readWindow": "mapping", "triple": "three numbers",
         "positions": "list of [x, y, z]"}


def member_comments(headers):
    """Comments behind the members of the structs, by the key that has the member's name."""
    comments = {}
    for header in headers:
        for names, comment in re.findall(r"^\s+[\w:<>]+ ([\w, =.{}-]+);\s+///< (.*)$", read(ROOT / header), re.M):
            for name in re.findall(r"\b([a-z]\w*)\b", re.sub(r"=[^,]*", "", names)):
                comments[re.sub("_rad$", "_deg", name)] = comment
    return comments


def yaml_rows(name, sources, headers):
    comments, rows, plausible = member_comments(headers), {}, {}
    for match in re.finditer(r'\{"(\w+)", &RadarConfig::\w+, ([-\de.]+), ([-\de.]+),',
                             read(ROOT / "mmradartwin_dsp/src/radar_plausibility.cpp")):
        plausible[match.group(1)] = (match.group(2), match.group(3))
    for source in sources:
        text = read(ROOT / source)
        for key, unit, least, most, required in re.findall(
                r'\{\s*"(\w+)", "([\w/]+)", &\w+::\w+, ([-\d.e]+), ([-\d.e]+)(?:, (true|false))?\}', text):
            allowed = f"{least} to {most}" + (f" {unit}" if not required else "")
            rows[key] = [f"`{key}`", "number", allowed, "yes" if required == "true" else ""]
        methods = "|".join(KINDS)
        for call, arguments, place in calls(text, rf"\b(?:\w+\.)?(?:{methods})"):
            kind = call.split(".")[-1]
            if "." not in call:
                arguments = arguments[1:]  # the first one is the mapping
            key = string(arguments[0]) if arguments else None
            if key is None or "." in call and re.search(r"values\.\w+$", text[:place + len(call)]):
                continue
            optional = f'has("{key}")' in text or kind in ("readNumber", "readWindow", "triple")
            allowed = ""
            if kind in ("number", "integer", "numbers", "integers", "integerLists", "readNumber") and len(arguments) > 2:
                allowed = f"{number(arguments[1])} to {number(arguments[2])}"
            elif kind == "choice":
                allowed = ", ".join(re.findall(r'"([^"]+)"', arguments[1])) or constant(arguments[1].strip("{}"), "").strip('"')
                allowed = allowed or re.search(r'kFormat = "([^"]+)"', text).group(1)
            elif kind == "readRadarNumber":
                allowed = " to ".join(plausible.get(key, ("", "")))
            rows.setdefault(key, [f"`{key}`", KINDS[kind], allowed, "" if optional else "yes"])
    missing = [key for key in rows if key not in comments and key not in MEANINGS]
    if missing:
        fail(f"{sources[0]}: no meaning for {', '.join(missing)}: give the member a comment, or add it to MEANINGS")
    stem = name.split(".")[0]
    return [row[:3] + [row[3], MEANINGS.get(f"{stem}: {key}", comments.get(key, MEANINGS.get(key, "")))]
            for key, row in rows.items()]


def yaml_page():
    text = "# Keys of the YAML files\n\n" + NOTE + (
        "An unknown key, a wrong type and a value out of range are errors that name file, key, value and what is allowed.\n"
        "Units are SI unless the key's name says otherwise. Paths are relative to the file that names them, or\n"
        "`package://PACKAGE/…`.\n\n")
    for name, sources, headers in YAML_FILES:
        text += f"## {name}\n\n" + table(["key", "type", "allowed", "required", "meaning"],
                                           yaml_rows(name, sources, headers)) + "\n"
    return text


# ---- mechanisms

def mechanism_rows(text):
    rows = []
    # A lambda that makes alike parameters is written out.
    for name, body in re.findall(r"const auto (\w+) = \[\]\(const char\* name, const char\* meaning\) \{(.*?)\};", text, re.S):
        for own in re.finditer(rf'\b{name}\(("\w+"), ("[^"]*")\)', text):
            text += body.replace("name,", own.group(1) + ",").replace("meaning", own.group(2))
    for call, arguments, _ in calls(text, r"\b(?:number|integer|optionalNumbers|text|texts)Spec"):
        name = string(arguments[0])
        if name is None:
            continue
        if call.startswith("text"):
            required = call == "textsSpec" or arguments[1] == "true"
            default = "" if required or call == "textsSpec" else string(arguments[2])
            rows.append([f"`{name}`", "", "texts" if call == "textsSpec" else "text", "yes" if required else "", default,
                         string(arguments[-1]) or "see below"])
            continue
        unit, limits = string(arguments[1]) or "", f"{number(arguments[2])} to {number(arguments[3])}"
        given = len(arguments) > 5
        after = "required = " in text and re.search(rf'(\w+) = {call}\("{name}"', text)
        required = not given and call != "optionalNumbersSpec"
        if after:
            stated = re.search(rf"\b{after.group(1)}\.required = (\w+)", text)
            required = stated.group(1) == "true" if stated else required
            if f"{after.group(1)}.kind = ParameterKind::kNumbers" in text:
                limits += ", a list"
        if call == "optionalNumbersSpec":
            limits += ", a list"
        rows.append([f"`{name}`", unit, limits, "yes" if required else "", number(arguments[4]) if given and not required else "",
                     string(arguments[-1]) or ""])
    return rows


def mechanisms_page():
    text = "# Mechanisms\n\n" + NOTE + (
        "A mechanism is one part of the simulation; `twin.yaml` lists those that a twin has, with their parameters:\n\n"
        "```yaml\nmechanisms:\n  specular: {max_bounces: 3}\n  corner: {}\n  diffuse: {}\n"
        "  radar_yaw_offset: {yaw_deg: 2.0}\n```\n\n"
        "Without a `twin.yaml` a twin has `specular`, `corner` and `diffuse`. Mechanisms that answer a cause bear the cause's\n"
        "name: see [causes](causes.md) for what each does to the signal.\n\n"
        "To try one, write such a file and compare: `evaluate RECORDING --twin FILE`. While a twin runs live,\n"
        "`rosservice call /twin/apply \"file: '/path/of/FILE'\"` does the same at once, and `\"file: ''\"` goes back.\n\n")
    for folder in sorted(p for p in (ROOT / "mmradartwin_sim/src/mechanisms").iterdir() if p.is_dir()):
        text += f"## {folder.name}\n\n"
        for path in sorted(folder.glob("*.cpp")):
            source = read(path)
            if "REGISTER" not in source:
                continue
            name = re.search(r'^const std::string k\w+ = "(\w+)"', source, re.MULTILINE).group(1)
            about = re.search(r"((?:^/// .*\n)+)class \w+ : public Mechanism", source, re.M)
            words = " ".join(line[4:].strip() for line in about.group(1).splitlines()) if about else ""
            text += f"### {name}\n\n" + (words + "\n\n" if words else "")
            rows = mechanism_rows(source)
            text += (table(["parameter", "unit", "allowed", "required", "default", "meaning"], rows) if rows
                     else "No parameters.\n") + "\n"
    return text


PAGES = {"programs.md": programs_page, "parameters.md": parameters_page, "topics.md": topics_page,
         "messages.md": messages_page, "yaml.md": yaml_page, "mechanisms.md": mechanisms_page}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="write nothing; exit 1 where a page is out of date")
    check = parser.parse_args().check
    stale = []
    for name, page in PAGES.items():
        path, text = REFERENCE / name, page().rstrip("\n") + "\n"
        if path.exists() and read(path) == text:
            continue
        stale.append(f"docs/reference/{name}")
        if not check:
            path.write_text(text, encoding="utf-8")
    print(("out of date: " if check else "written: ") + ", ".join(stale) if stale else "all pages are current")
    return 1 if check and stale else 0


if __name__ == "__main__":
    sys.exit(main())
