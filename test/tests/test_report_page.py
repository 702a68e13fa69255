"""report.html of evaluate and diagnose: it stands alone, is well-formed, says the same as the files beside it, and fits a phone
and a desk."""
import csv
import html
import json
import os
import re
import shutil
import subprocess
import tempfile
import unittest
import xml.etree.ElementTree

from mmradartwin_tests import effects
from mmradartwin_tests.installed_programs import find_program
from mmradartwin_tests.session import Measurement, Settings
from diagnose_program import PROGRAM
from doc_pages import ROOT

CHROMIUM = shutil.which("chromium")
WIDTHS_PX = 390, 1200
LEAST_CONTRAST = 4.5    # of letters, WCAG 2.2 AA
POPPLER = all(shutil.which(program) for program in ("pdfimages", "pdftotext", "pdftoppm"))

PROBE = """<script>
document.querySelectorAll("details").forEach(d => d.open = true);
const width = document.documentElement.scrollWidth;
const outside = [...document.querySelectorAll("body *")].filter(e => e.getClientRects().length &&
  (e.getBoundingClientRect().right > innerWidth + 0.5 || e.getBoundingClientRect().left < -0.5))
  .map(e => e.outerHTML.slice(0, 90));
const words = [...document.querySelectorAll(".word")], shown = [];
for (const word of words) {
  word.focus({preventScroll: true});
  const meaning = word.querySelector(".meaning"), box = meaning.getBoundingClientRect();
  shown.push(getComputedStyle(meaning).display == "block" && box.left >= 0 && box.right <= innerWidth && box.top >= 0 &&
             box.bottom <= innerHeight);
}
parent.document.title = JSON.stringify({inner: innerWidth, width, outside, words: words.length,
                                        shown: shown.filter(s => s).length});
</script></body>"""


def luminance(color):
    parts = [int(color[i:i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055)**2.4 for p in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(first, second):
    light, dark = sorted((luminance(first), luminance(second)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


def lines_of(element):
    """Its words without blanks, as a page that is printed shows them: meanings of words are left out."""
    if element.get("class") == "meaning":
        return ""
    inside = "".join(lines_of(child) + (child.tail or "") for child in element)
    return re.sub(r"\s", "", (element.text or "") + inside)


def folded(root):
    """Elements within what is folded, which is not printed."""
    return {inside for details in root.iter("details") if details.get("class") != "printed" for child in details
            if child.tag != "summary" for inside in child.iter()}


def value_at(folder, of):
    """What a file holds at FILE#POINTER: of JSON a pointer (RFC 6901), of CSV /ROW/COLUMN with rows from 0 on."""
    name, pointer = of.split("#")
    steps = pointer.split("/")
    with open(os.path.join(folder, name), encoding="utf-8", newline="") as file:
        if name.endswith(".csv"):
            return list(csv.DictReader(file))[int(steps[-2])][steps[-1]]
        value = json.load(file)
    for step in steps[1:]:
        value = value[int(step)] if isinstance(value, list) else value[step]
    return value


def is_rounded(shown, value):
    """True where a text is the number, rounded to the digits that it shows."""
    text = shown.replace("\u2212", "-")
    least = text.startswith("less than ")
    text = text.removeprefix("less than ")
    scale = 100 if text.endswith(" %") else 1
    text = text.removesuffix(" %")
    if least:
        return value * scale < float(text)
    mantissa, _, exponent = text.partition("e")
    decimals = len(mantissa.partition(".")[2])
    return abs(float(text) - value * scale) <= 0.5001 * 10.0**(int(exponent or 0) - decimals) * max(1, abs(value) * 1e-9)


@unittest.skipIf(PROGRAM is None, "mmradartwin_attribution diagnose is not built in this workspace")
class ReportPage(unittest.TestCase):
    """Reports of a session whose radar reads all ranges 6 cm too long."""

    @classmethod
    def setUpClass(cls):
        cls.out = tempfile.mkdtemp(prefix="mmradartwin_report_")
        session = cls.at("session")
        hidden = effects.make_effect("range_bias", {"range_m": 0.06})
        Measurement(Settings(output=session, seed=41, poses=12, locations=6, headings=2, frames=10, effects=[hidden])).run()
        evaluate = find_program("mmradartwin_attribution", "evaluate")
        for command in ([evaluate, session, "--output", cls.at("evaluate"), "--no-bag"],
                        [PROGRAM, session, "--output", cls.at("diagnose")]):
            subprocess.run(command, check=True, capture_output=True, timeout=1200)
        cls.folders = {"evaluate": cls.at("evaluate"), "diagnose": cls.at("diagnose")}
        cls.pages = {}
        for name, folder in cls.folders.items():
            with open(os.path.join(folder, "report.html"), encoding="utf-8") as file:
                cls.pages[name] = file.read()

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.out, ignore_errors=True)

    @classmethod
    def at(cls, *parts):
        return os.path.join(cls.out, *parts)

    def elements(self, name, tag):
        return list(xml.etree.ElementTree.fromstring(self.pages[name]).iter(tag))

    def test_is_well_formed(self):
        for name, page in self.pages.items():
            self.assertTrue(page.startswith("<!DOCTYPE html>\n"), name)
            root = xml.etree.ElementTree.fromstring(page)    # raises where a tag is not closed
            self.assertEqual([child.tag for child in root], ["head", "body"])
            self.assertNotIn("{{", page)

    def test_stands_alone(self):
        for name, page in self.pages.items():
            self.assertNotRegex(page, r"https?:|<script|<link|<iframe|@import|url\(|href=", name)
            sources = [element.get("src") for element in xml.etree.ElementTree.fromstring(page).iter() if element.get("src")]
            self.assertGreater(len(sources), 0, name)
            for source in sources:
                self.assertTrue(source.startswith("data:image/png;base64,iVBOR"), source[:40])

    def test_begins_with_the_answer(self):
        for name, start in (("evaluate", r"The twin explains [\d.]+ % of the measured power; \d+ of \d+ expected places do"),
                            ("diagnose", r"All echoes lie farther than the scene says by 0\.0[56]\d* m \(.*With it the twin exp")):
            said = "".join(self.elements(name, "p")[0].itertext())
            self.assertRegex(said, "^" + start)
            with open(os.path.join(self.folders[name], "summary.json"), encoding="utf-8") as file:
                self.assertEqual(json.load(file)["answer"], said)

    def test_every_number_is_that_of_a_file(self):
        for name, folder in self.folders.items():
            numbers = self.elements(name, "data")
            self.assertGreater(len(numbers), 60, name)
            for element in numbers:
                value = value_at(folder, element.get("data-of"))
                self.assertEqual(float(element.get("value")), float(value), element.get("data-of"))
                self.assertTrue(is_rounded(element.text, float(value)), f"{element.get('data-of')}: {element.text}, {value}")

    def test_poses_of_the_page_are_those_of_the_csv(self):
        folder = self.folders["evaluate"]
        with open(os.path.join(folder, "summary.json"), encoding="utf-8") as file:
            poses = {pose["pose"]: pose for pose in json.load(file)["poses"]}
        with open(os.path.join(folder, "poses.csv"), encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual([row["pose"] for row in rows], list(poses))
        for row in rows:
            pose = poses[row["pose"]]
            for column in ("active", "recalled"):
                self.assertEqual(int(row[column]), pose[column])
            for column in ("explained_power", "q1_energy", "q2_energy"):
                self.assertAlmostEqual(float(row[column]), pose[column], delta=0.6e-5, msg=column)
            for i in range(1, 6):
                self.assertEqual(int(row[f"c{i}"]), pose["classes"][f"C{i}"])

    def test_poses_of_a_diagnosis_are_those_of_evaluate(self):
        """As given and corrected; the page shows the worst two and the best with both twins."""
        evaluate = find_program("mmradartwin_attribution", "evaluate")
        subprocess.run([evaluate, self.at("session"), "--twin", self.at("diagnose", "twin.extended.yaml"), "--output",
                        self.at("corrected"), "--no-bag", "--no-pictures"], check=True, capture_output=True, timeout=300)

        def summary(folder):
            with open(self.at(folder, "summary.json"), encoding="utf-8") as file:
                return json.load(file)
        said = summary("diagnose")
        self.assertEqual(said["worst_first"], summary("evaluate")["worst_first"])
        for twin, folder in (("given", "evaluate"), ("corrected", "corrected")):
            told = {pose["pose"]: pose for pose in summary(folder)["poses"]}
            self.assertEqual([pose["pose"] for pose in said["poses"]], list(told))
            for pose in said["poses"]:
                for key in ("active", "recalled"):
                    self.assertEqual(pose[twin][key], told[pose["pose"]][key], pose["pose"])
                self.assertAlmostEqual(pose[twin]["explained_power"], told[pose["pose"]]["explained_power"], delta=1e-4)
        shown = ["".join(head.itertext()) for head in self.elements("diagnose", "h3")]
        worst = said["worst_first"]
        for rank, pose in (("worst", worst[0]), ("second worst", worst[1]), ("best", worst[-1])):
            self.assertIn(f"The {rank}: pose {pose}", shown)
        pictures = [image.get("alt") for image in self.elements("diagnose", "img")]
        for what in ("measured map", "map of the twin as given", "map of the corrected twin", "twin as given minus measured",
                     "corrected twin minus measured"):
            self.assertIn(f"{what} of pose {worst[0]}", pictures)

    def test_table_cells_with_digits_are_numbers_of_a_file(self):
        """No number of a table is written beside the files; the paper's stand in summary.json, or in the column that says so."""
        for name in self.pages:
            for row in self.elements(name, "tr"):
                for cell in row.iter("td"):
                    loose = (cell.text or "") + "".join(child.tail or "" for child in cell)
                    if cell.get("class") == "n" and re.search(r"\d", loose):
                        self.assertRegex(loose, r"^\d+$", "a round of the search alone")

    def test_words_are_those_of_the_glossary(self):
        with open(ROOT / "docs/start/glossary.md", encoding="utf-8") as file:
            glossary = file.read().replace("`", "")
        for name in self.pages:
            words = [span for span in self.elements(name, "span") if span.get("class") == "word"]
            self.assertGreater(len(words), 10)
            for word in words:
                self.assertEqual(word.get("tabindex"), "0")
                meaning = "".join(word.find("span").itertext()).split(": ", 1)[1]
                self.assertIn(f" | {meaning} |", glossary)

    def test_letters_stand_out(self):
        styles = self.elements("evaluate", "style")[0].text
        themes = re.findall(r":root \{(.*?)\}", styles, re.S)
        self.assertEqual(len(themes), 3, "light, dark and print")
        for theme in themes:
            color = dict(re.findall(r"--(\w+): (#[0-9a-f]{6})", theme))
            for letters, ground in (("ink", "paper"), ("soft", "paper"), ("mark", "paper"), ("ink", "field"), ("soft", "field"),
                                    ("ink", "warn"), ("paper", "ink")):
                self.assertGreaterEqual(contrast(color[letters], color[ground]), LEAST_CONTRAST, f"{letters} on {ground}")

    def test_templates_may_be_changed(self):
        folder = self.at("templates")
        os.makedirs(folder)
        evaluate = find_program("mmradartwin_attribution", "evaluate")
        command = [evaluate, self.at("session"), "--no-bag", "--no-pictures", "--report-templates", folder,
                   "--output", self.at("mine")]
        wrong = f"{folder}/evaluation.html:2: there is no name 'anser'; did you mean 'answer'?"
        for text, status, said in (("<p>{{answer}}</p>\n{{anser}}", 2, wrong), ("<p>mine: {{answer}}</p>", 0, "")):
            with open(os.path.join(folder, "evaluation.html"), "w", encoding="utf-8") as file:
                file.write(text)
            run = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
            self.assertEqual(run.returncode, status, run.stderr)
            self.assertIn(said, run.stderr)
            self.assertEqual(os.path.exists(self.at("mine", "report.html")), status == 0)
        with open(self.at("mine", "report.html"), encoding="utf-8") as file:
            self.assertTrue(file.read().startswith("<p>mine: The twin explains <data "))

    @unittest.skipIf(CHROMIUM is None, "needs Debian's chromium")
    def test_fits_a_phone_and_a_desk(self):
        for name, page in self.pages.items():
            probe = self.at(f"{name}.html")
            for width in WIDTHS_PX:
                # In a frame: windows have a least width.
                with open(probe, "w", encoding="utf-8") as file:
                    file.write(f'<body><iframe style="border:0;width:{width}px;height:800px" srcdoc="'
                               f'{html.escape(page.replace("</body>", PROBE))}"></iframe></body>')
                run = subprocess.run([CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--dump-dom",
                                      f"--user-data-dir={self.at('chromium')}", "--window-size=1300,900", "file://" + probe],
                                     capture_output=True, text=True, check=True, timeout=120)
                said = json.loads(html.unescape(re.search(r"<title>(\{.*\})</title>", run.stdout).group(1)))
                self.assertEqual(said["inner"], width)
                self.assertLessEqual(said["width"], width, f"{name}: {said['outside'][:3]}")
                self.assertEqual(said["outside"][:3], [], name)
                self.assertEqual(said["shown"], said["words"], f"{name}: meanings at {width} px")

    def printed(self, name):
        """The page as Chromium prints it for somebody whose screen is dark."""
        pdf = self.at(name + ".pdf")
        subprocess.run([CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--no-pdf-header-footer",
                        "--blink-settings=preferredColorScheme=0", f"--user-data-dir={self.at('chromium')}",
                        "--print-to-pdf=" + pdf, "file://" + os.path.join(self.folders[name], "report.html")],
                       capture_output=True, check=True, timeout=120)
        return pdf

    @unittest.skipIf(CHROMIUM is None or not POPPLER, "needs Debian's chromium and poppler-utils")
    def test_prints_without_cuts_on_white_paper(self):
        for name in self.pages:
            pdf = self.printed(name)

            def told(*command, **options):
                return subprocess.run(command, capture_output=True, check=True, timeout=120, **options).stdout
            root = xml.etree.ElementTree.fromstring(self.pages[name])
            hidden = folded(root)
            self.check_pictures(name, root, told("pdfimages", "-list", pdf, text=True))
            pages = [re.sub(r"\s", "", page) for page in told("pdftotext", "-raw", pdf, "-", text=True).split("\f")]
            rows = [lines_of(row) for row in root.iter("tr") if row not in hidden]
            self.assertGreater(len(rows), 5)
            for row in rows:
                self.assertTrue(any(row in page for page in pages), f"{name}: the row {row} is cut")
            heads = [lines_of(head) for tag in ("h2", "h3") for head in root.iter(tag) if head not in hidden]
            for head in heads:
                self.assertFalse(any(page.endswith(head) for page in pages), f"{name}: {head} is the last of a page")
            for width, right in self.rights(told("pdftotext", "-bbox", pdf, "-", text=True)):
                self.assertAlmostEqual(width, 595, delta=1)    # A4 upright, in points
                self.assertLess(right, width - 20, name)
            paper = told("pdftoppm", "-r", "30", "-gray", pdf)
            self.assertGreater(paper.count(b"\xff"), 0.5 * len(paper), f"{name}: the paper is not white")

    def check_pictures(self, name, root, listed):
        """Each stands on one page, as wide as its letters can be read."""
        pages_of = {}
        for line in listed.splitlines()[2:]:
            page, _, kind, width, _, *rest = line.split()
            if kind == "image":
                pages_of.setdefault(rest[5], set()).add(page)
                self.assertLess(float(rest[7]), 400, "dots per inch: a picture as small as a stamp")
        self.assertEqual({len(pages) for pages in pages_of.values()}, {1}, f"{name}: a picture is cut")
        self.assertEqual(len(pages_of), len({image.get("src") for image in root.iter("img")}), name)

    @staticmethod
    def rights(boxes):
        """[(width of the page, right edge of a word)]."""
        return [(float(page), float(right)) for page, words in re.findall(r'<page width="([\d.]+)"(.*?)</page>', boxes, re.S)
                for right in re.findall(r'xMax="([\d.]+)"', words)]


if __name__ == "__main__":
    unittest.main()
