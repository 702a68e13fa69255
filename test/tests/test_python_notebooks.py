"""The notebooks, run as they stand: their code cells one after the other in one namespace, without Jupyter."""
import json
import os
import unittest
from unittest import mock

import mmradartwin
from mmradartwin_tests.installed_programs import find_program
from in_folder import InFolder
from made_session import make_session

try:
    import matplotlib
    from mmradartwin import sim
except ImportError:
    sim = None
NOTEBOOKS = os.path.join(os.path.dirname(os.path.realpath(__file__)), "..", "..", "mmradartwin_dsp", "python", "notebooks")


@unittest.skipIf(sim is None, "mmradartwin.sim or matplotlib is not here")
class Notebooks(InFolder):
    def run_notebook(self, name, **environment):
        """What the cells leave behind."""
        matplotlib.use("Agg")
        with open(os.path.join(NOTEBOOKS, name), encoding="utf-8") as file:
            notebook = json.load(file)
        self.assertEqual(notebook["nbformat"], 4)
        left = {}
        with mock.patch.dict(os.environ, environment):
            for number, cell in enumerate(notebook["cells"]):
                if cell["cell_type"] == "code":
                    self.assertEqual(cell["outputs"], [], "outputs are not kept with the notebook")
                    exec(compile("".join(cell["source"]), f"{name}, cell {number}", "exec"), left)
        return left

    def test_look_at_a_recording(self):
        make_session(self.at("lab"), 2, 5)
        left = self.run_notebook("look_at_a_recording.ipynb", MMRADARTWIN_SESSION=self.at("lab"))
        self.assertEqual(left["frames"].counts.shape, (5, 2, 64, 4, 2))
        # The generator's room is the twin's: the strongest echo is that of a path within a bin.
        nearest = left["paths"].length_m[left["strongest"]] / 2
        self.assertAlmostEqual(nearest, left["range_m"], delta=left["radar"].range_bin_m)
        self.assertGreater(left["measured"].strongest()[2], -60)

    @unittest.skipIf(find_program("mmradartwin_attribution", "diagnose") is None, "diagnose is not built in this workspace")
    def test_hide_an_effect_and_find_it(self):
        left = self.run_notebook("hide_an_effect_and_find_it.ipynb", MMRADARTWIN_FOLDER=self.folder)
        truth = left["hidden"]["parameters"]["cos_exponent"]
        self.assertIsInstance(left["findings"], mmradartwin.Findings)
        self.assertEqual(left["found"].cause, "element_pattern")
        self.assertAlmostEqual(left["found"].parameters["cos_exponent"].value, truth, delta=0.6)
        self.assertAlmostEqual(left["by_hand"], truth, delta=1.5)
        self.assertGreater(max(left["explained"]), left["explained"][0])


if __name__ == "__main__":
    unittest.main()
