"""Every command that README and docs/ print runs as printed, in a folder of its own, but for those marked `no-test`."""
import os
import resource
import shutil
import subprocess
import unittest
from pathlib import Path

from mmradartwin_tests.installed_programs import find_program
from doc_pages import ROOT, fences, name_of, pages
from in_folder import InFolder

# The README's first diagnosis makes these, and the other pages name them.
SHARED = ["lab", "lab.bag", "lab_report", "lab_diagnosis", "lab_after", "truth.json"]
TIME_LIMIT_S = 1500


@unittest.skipIf(find_program("mmradartwin_attribution", "diagnose") is None, "the programs are not built in this workspace")
class DocCommands(InFolder):
    def run_page(self, page, folder, done):
        """Runs the commands of a page one after the other in one shell; returns them, and those that are marked."""
        folder.mkdir(exist_ok=True)
        if not (folder / "run.sh").exists():
            (folder / "run.sh").symlink_to(ROOT / "run.sh")
        ran, marked, script = [], [], ["set -eo pipefail"]
        for fence in fences(page):
            if fence.mark == "file":
                path = folder / fence.about
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(fence.text, encoding="utf-8")
            if fence.mark == "no-test":
                marked += [(fence.about, command) for command in fence.commands]
                continue
            steps = fence.commands if fence.language == "console" else []
            if fence.language == "python" and not fence.mark:
                source = folder / f".line_{fence.line}.py"
                source.write_text(fence.text, encoding="utf-8")
                steps = [f"/usr/bin/python3 {source.name}"]
            for command in steps:
                if command in done:
                    continue
                if command.startswith("./run.sh") and not (ROOT / ".ws/devel/setup.bash").exists():
                    marked.append(("the workspace is not that of run.sh", command))
                    continue
                ran.append(command)
                script += [f"echo {len(ran)} > .step", command]
        if ran:
            result = subprocess.run(["bash", "-c", "\n".join(script)], cwd=folder, stdout=subprocess.PIPE, text=True,
                                    stderr=subprocess.STDOUT, timeout=TIME_LIMIT_S, check=False, stdin=subprocess.DEVNULL)
            if result.returncode:
                step = int((folder / ".step").read_text(encoding="utf-8"))
                self.fail(f"{name_of(page)}: exit status {result.returncode} of\n  {ran[step - 1]}\n{result.stdout[-3000:]}")
        return ran, marked

    def test_run_as_printed(self):
        first = Path(self.at("first"))
        readme, *others = pages()
        ran, marked = self.run_page(readme, first, set())
        done, total = set(ran), len(ran)
        self.assertTrue(done, msg="README.md prints no command that runs")
        subprocess.run(["rosrun", "mmradartwin_dsp", "session_to_bag", "lab", "lab.bag"], cwd=first, check=True,
                       capture_output=True, timeout=TIME_LIMIT_S)
        for page in others:
            with self.subTest(page=name_of(page)):
                folder = Path(self.at(name_of(page).replace(os.sep, "_")))
                if any(f.language in ("console", "python") and f.mark != "no-test" for f in fences(page)):
                    folder.mkdir()
                    for name in SHARED:
                        source = first / name
                        (shutil.copytree if source.is_dir() else shutil.copy)(source, folder / name)
                page_ran, page_marked = self.run_page(page, folder, done)
                total += len(page_ran)
                marked += page_marked
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        print(f"\n{total} commands ran in {used.ru_utime + used.ru_stime:.0f} s of a core, {len(marked)} are marked as not run:")
        for why in sorted({why for why, _ in marked}):
            print(f"  {sum(1 for w, _ in marked if w == why)} {why}")


if __name__ == "__main__":
    unittest.main()
