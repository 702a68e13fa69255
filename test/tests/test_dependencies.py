"""package.xml files name only what rosdep knows, and what it does not know is installed by run.sh. What demo and try start
is marked as such in CMakeLists.txt."""
import glob
import os
import re
import subprocess
import unittest
import xml.etree.ElementTree

import yaml

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))


# What python3-rosdep2 brings along; rosdep reads it before all else.
DEBIANS_LIST = "/usr/share/python3-rosdep2/debian.yaml"


def known():
    """{section: {name: Debian packages}} of rosdep_keys.txt."""
    sections, names = {}, None
    with open(os.path.join(ROOT, "test", "rosdep_keys.txt"), encoding="utf-8") as file:
        for line in map(str.strip, file):
            if line.startswith("["):
                names = sections.setdefault(line.strip("[]"), {})
            elif line and not line.startswith("#"):
                name, _, debian = line.partition(":")
                names[name] = debian.split()
    return sections


def packages():
    """{name: root element} of the repository's packages."""
    roots = [xml.etree.ElementTree.parse(file).getroot() for file in glob.glob(os.path.join(ROOT, "*", "package.xml"))]
    return {root.findtext("name"): root for root in roots}


def dependencies(root):
    return {(element.tag, element.text) for element in root if element.tag.endswith("depend")}


def debian_packages():
    """Names in run.sh's list."""
    with open(os.path.join(ROOT, "run.sh"), encoding="utf-8") as file:
        return re.search(r"^packages=\(\n(.*?)\)$", file.read(), re.MULTILINE | re.DOTALL).group(1).split()


def apt_knows_bookworm():
    with open("/etc/os-release", encoding="utf-8") as file:
        return "VERSION_CODENAME=bookworm\n" in file.read() and glob.glob("/var/lib/apt/lists/*_Packages*")


def started_by(files):
    """Targets of the repository's compiled programs that scripts and launch files start, with what these include."""
    left, seen, targets = list(files), set(), set()
    while left:
        file = left.pop()
        if file in seen:
            continue
        seen.add(file)
        with open(os.path.join(ROOT, "launch", file), encoding="utf-8") as opened:
            text = opened.read()
        programs = re.findall(r"rosrun (mmradartwin_\w+) (\S+)", text)
        if file.endswith(".launch"):
            root = xml.etree.ElementTree.fromstring(text)
            programs += [(node.get("pkg"), node.get("type")) for node in root.iter("node")]
            left += [include.get("file").split(")/")[1] for include in root.iter("include")]
        else:
            left += re.findall(r"^[^#\n]*?(?:mmradartwin_launch|launched .*) (\w+\.launch)", text, re.MULTILINE)
        targets |= {f"{package}_{program}" for package, program in programs
                    if package.startswith("mmradartwin_") and "." not in program}
    return targets.union(*map(started_in_turn, targets))


def started_in_turn(target):
    """Targets of the programs that stand beside a program and that it starts. emulated_rig is for rig:=emulated alone."""
    package, program = re.match(r"(mmradartwin_[a-z]+)_(\w+)", target).groups()
    started = set()
    for source in glob.glob(os.path.join(ROOT, package, "*", f"{program}.cpp")):
        with open(source, encoding="utf-8") as text:
            for call in re.findall(r"programBeside\((.*)\)", text.read()):
                started |= set(re.findall(r'"(\w+)"', call)) - {"emulated_rig"}
    return {f"{package}_{name}" for name in started}


class Dependencies(unittest.TestCase):
    def test_there_are_all_packages(self):
        self.assertGreaterEqual(len(packages()), 8)

    def test_every_name_is_known_to_rosdep(self):
        sections, ours = known(), packages()
        allowed = {*sections["ROS packages"], *sections["rosdep keys"], *ours}
        for name, root in ours.items():
            for tag, depended in dependencies(root):
                self.assertIn(depended, allowed, f"{name}'s package.xml, {tag}: look it up as rosdep_keys.txt says")

    def test_every_known_name_is_used(self):
        sections = known()
        used = {depended for root in packages().values() for _, depended in dependencies(root)}
        self.assertEqual(sorted({*sections["ROS packages"], *sections["rosdep keys"]} - used), [])

    def test_every_known_name_stands_for_packages(self):
        sections = known()
        for name, debian in {**sections["ROS packages"], **sections["rosdep keys"]}.items():
            self.assertTrue(debian, name)

    @unittest.skipUnless(apt_knows_bookworm(), "needs Debian 12 after apt-get update")
    def test_debian_12_has_these_packages(self):
        sections = known()
        wanted = {*sections["no key"]}.union(*sections["ROS packages"].values(), *sections["rosdep keys"].values())
        said = subprocess.run(["apt-cache", "policy", *sorted(wanted)], capture_output=True, text=True, check=True,
                              timeout=120, env={**os.environ, "LC_ALL": "C"}).stdout
        there = re.findall(r"^(\S+):\n  Installed: .*\n  Candidate: (?!\(none\))", said, re.MULTILINE)
        self.assertEqual(sorted(wanted - set(there)), [])

    @unittest.skipUnless(os.path.exists(DEBIANS_LIST), "needs python3-rosdep2")
    def test_packages_of_ros_are_those_of_debians_list(self):
        with open(DEBIANS_LIST, encoding="utf-8") as file:
            debians = yaml.safe_load(file)
        for name, debian in known()["ROS packages"].items():
            self.assertEqual(debian, debians.get(name, {}).get("debian"), name)

    def test_what_rosdep_does_not_know_is_installed_by_name(self):
        for name in known()["no key"]:
            self.assertIn(name, debian_packages())

    def test_demo_and_try_build_what_they_start(self):
        built = []
        for file in glob.glob(os.path.join(ROOT, "*", "CMakeLists.txt")):
            with open(file, encoding="utf-8") as opened:
                programs = re.findall(r"^mmradartwin_program\((\w+) DEMO ", opened.read(), re.MULTILINE)
            built += [f"{os.path.basename(os.path.dirname(file))}_{program}" for program in programs]
        started = started_by(["scripts/demo.sh", "scripts/try.sh"])
        self.assertIn("mmradartwin_driver_session_player", started)
        self.assertIn("mmradartwin_driver_dca1000_emulator", started)
        self.assertIn("mmradartwin_dsp_session_to_bag", started)
        self.assertEqual(sorted(started), sorted(built))

    def test_all_packages_bear_one_version_and_have_a_changelog_of_it(self):
        versions = {name: root.findtext("version") for name, root in packages().items()}
        self.assertEqual(len(set(versions.values())), 1, versions)
        version = next(iter(versions.values()))
        for file in glob.glob(os.path.join(ROOT, "*", "package.xml")):
            changelog = os.path.join(os.path.dirname(file), "CHANGELOG.rst")
            with open(changelog, encoding="utf-8") as text:
                first = re.search(r"^(\d+\.\d+\.\d+) \(", text.read(), re.MULTILINE)
            self.assertEqual(first and first.group(1), version, changelog)
        with open(os.path.join(ROOT, "CITATION.cff"), encoding="utf-8") as text:
            self.assertIn(f"version: {version}\n", text.read())


if __name__ == "__main__":
    unittest.main()
