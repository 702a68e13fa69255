"""README's size and words, links of all pages, paths that sources name, and whether generated pages are current."""
import re
import subprocess
import sys
import unittest

from mmradartwin_tests.installed_programs import find_program
from doc_pages import ROOT, fences, name_of, pages, prose

MOST_LINES, MOST_BYTES = 150, 8000
LINK = re.compile(r"\[(?:[^\]\[]|\[[^\]]*\])*\]\(([^)\s]+)\)")


def slug(heading):
    """Anchor of a heading, as the site and code hosts make it."""
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading)
    return re.sub(r"[-\s]+", "-", re.sub(r"[^\w\s-]", "", text.replace("`", "")).strip().lower())


def anchors(page):
    return {slug(h) for h in re.findall(r"^#+ (.*)$", prose(page), re.M)}


def sections(page):
    """Text of each second-level section of a page by its heading."""
    return dict(re.findall(r"^## (\S+)\n(.*?)(?=^## |\Z)", page.read_text(encoding="utf-8"), re.M | re.S))


def text_of(page):
    """Words as a reader sees them: no fences, no targets of links, no pictures' files."""
    return re.sub(r"\]\([^)]*\)", "]", prose(page))


class Readme(unittest.TestCase):
    page = ROOT / "README.md"

    def test_is_short(self):
        text = self.page.read_text(encoding="utf-8")
        self.assertLessEqual(len(text.splitlines()), MOST_LINES)
        self.assertLessEqual(len(text.encode()), MOST_BYTES)

    def test_names_the_command_of_continuous_integration(self):
        command = (ROOT / ".ci/run").read_text(encoding="utf-8").strip().splitlines()[-1].removeprefix("exec ")
        self.assertIn(command, [c for fence in fences(self.page) for c in fence.commands])

    def test_explains_each_word_of_the_glossary_at_its_first_use(self):
        """At its first use a word stands in bold, where it is explained, or in a link."""
        text = prose(self.page)
        glossary = (ROOT / "docs/start/glossary.md").read_text(encoding="utf-8")
        words = [w.strip() for row in re.findall(r"^\| ([^|]+) \|", glossary, re.M) for w in row.split(",")]
        used, problems = 0, []
        for word in words:
            match = re.search(rf"(?<![\w`/.]){re.escape(word)}s?(?![\w`/.]\w|\w)", text, re.I)
            if not match or word in ("word", "---"):
                continue
            used += 1
            start = text.rfind("\n\n", 0, match.start())
            before, after = text[start:match.start()], text[match.end():]
            bold = before.count("**") % 2 == 1
            linked = before.rfind("[") > before.rfind("]") and "](" in after[:200]
            if not bold and not linked:
                problems.append(f"{match.group()}: …{text[max(0, match.start() - 40):match.end() + 30]}…")
        self.assertEqual(problems, [], msg="neither explained (in bold) nor linked at their first use")
        self.assertGreater(used, 5)


class Pages(unittest.TestCase):
    def test_links_lead_somewhere(self):
        problems, count = [], 0
        for page in pages() + [ROOT / "CONTRIBUTING.md", ROOT / "test/README.md"]:
            for target in LINK.findall(prose(page)):
                if re.match(r"https?://|mailto:", target):
                    continue
                count += 1
                path, _, anchor = target.partition("#")
                file = (page.parent / path).resolve() if path else page
                if not file.exists():
                    problems.append(f"{name_of(page)}: {target} is not there")
                elif anchor and anchor not in anchors(file):
                    problems.append(f"{name_of(page)}: {target}: no such heading")
                elif ROOT / "docs" in page.parents and file.is_file() and ROOT / "docs" not in file.parents:
                    problems.append(f"{name_of(page)}: {target} is no page of the site; name the file as text")
        self.assertEqual(problems, [])
        self.assertGreater(count, 100)

    def test_pages_that_sources_name_are_there(self):
        names = subprocess.run(["git", "-C", str(ROOT), "ls-files"], capture_output=True, text=True, check=True).stdout.split("\n")
        problems = []
        for name in names:
            if not re.search(r"\.(cpp|h|py|sh|msg|srv|action|yaml|launch|cmake|md)$|CMakeLists\.txt$", name):
                continue
            path = ROOT / name
            if not path.exists():
                continue
            for target, anchor in re.findall(r"\bdocs/([\w/]+\.md)(?:#([\w-]+))?", path.read_text(encoding="utf-8")):
                page = ROOT / "docs" / target
                if not page.exists():
                    problems.append(f"{name}: docs/{target} is not there")
                elif anchor and anchor not in anchors(page):
                    problems.append(f"{name}: docs/{target}#{anchor}: no such heading")
        self.assertEqual(problems, [])

    def test_every_page_is_in_the_site(self):
        listed = set(re.findall(r"([\w/]+\.md)$", (ROOT / "docs/mkdocs.yml").read_text(encoding="utf-8"), re.M)) - {"index.md"}
        self.assertEqual(listed, {str(p.relative_to(ROOT / "docs")) for p in pages()[1:]})

    def test_fences_are_well_formed(self):
        for page in pages():
            for fence in fences(page):
                self.assertTrue(fence.text.strip(), msg=f"{name_of(page)}:{fence.line} is empty")
                if fence.language == "console":
                    self.assertTrue(fence.commands, msg=f"{name_of(page)}:{fence.line} has no line that begins with '$ '")

    def test_commands_use_options_that_there_are(self):
        """Those that are not run, too: each option of a program and argument of a launch file stands in the reference."""
        programs = sections(ROOT / "docs/reference/programs.md")
        arguments = sections(ROOT / "docs/reference/parameters.md")
        problems, looked_at = [], 0
        for page in pages():
            commands = [c for fence in fences(page) for c in fence.commands] + re.findall(r"`([^`\n]+)`", prose(page))
            for command in commands:
                ros = re.search(r"rosrun mmradartwin_\w+ ([\w.]+)(.*)", command)
                if ros and ros.group(1) in programs:
                    for option in re.findall(r"\s(--[\w-]+)", ros.group(2)):
                        looked_at += 1
                        if not re.search(rf"(?<![\w-]){option}(?![\w-])", programs[ros.group(1)]):
                            problems.append(f"{name_of(page)}: {ros.group(1)} has no {option}")
                elif ros and ros.group(1) not in arguments and not ros.group(1).isupper():
                    problems.append(f"{name_of(page)}: no program {ros.group(1)}")
                launch = re.search(r"(?:roslaunch mmradartwin_launch |^)(\w+\.launch)\b(.*)", command)
                if launch:
                    for argument in re.findall(r"(\w+):=", launch.group(2)):
                        looked_at += 1
                        if f"`{argument}`" not in arguments.get(launch.group(1), ""):
                            problems.append(f"{name_of(page)}: {launch.group(1)} has no argument {argument}")
        self.assertEqual(problems, [])
        self.assertGreater(looked_at, 50)

    def test_count_words(self):
        """Prints the words of each page; README's are bounded by its size."""
        counts = {name_of(page): len(text_of(page).split()) for page in pages()}
        for name, words in counts.items():
            print(f"{words:6d} words  {name}")
        self.assertLess(counts["README.md"], 1500)


@unittest.skipIf(find_program("mmradartwin_attribution", "diagnose") is None, "the programs are not built in this workspace")
class GeneratedPages(unittest.TestCase):
    def test_are_current(self):
        result = subprocess.run([sys.executable, str(ROOT / "docs/generate_reference.py"), "--check"], capture_output=True,
                                text=True, timeout=1500, check=False)
        self.assertEqual(result.returncode, 0,
                         msg=result.stdout + result.stderr + "run python3 docs/generate_reference.py in ./run.sh exec")


if __name__ == "__main__":
    unittest.main()
