"""A cause that only a user's plug-in knows: without the plug-in a law without a name, with it found by its name."""
import os
import unittest
from unittest import mock

from mmradartwin_tests import effects
from mmradartwin_tests.installed_programs import find_program
from mmradartwin_tests.session import Measurement, Settings
from diagnose_program import PROGRAM, diagnose
from in_folder import InFolder
from stated_error import assert_told

PLUGIN = find_program("mmradartwin_attribution", "libmmradartwin_test_height_gain.so")


@unittest.skipIf(PROGRAM is None, "mmradartwin_attribution diagnose is not built in this workspace")
class CauseOfPlugin(InFolder):
    def test_is_found_by_its_name_with_the_plugin_alone(self):
        measurement = Measurement(Settings(output=self.at("session"), seed=61, poses=16, headings=2, frames=6,
                                           tier="default", duplicates=0,
                                           effects=[effects.make_effect("height_gain", {"db_per_m": 30.0}, None)]))
        measurement.run()
        status, without, errors = diagnose(self.at("session"), self.at("without"), "--findings", "1")
        self.assertEqual(status, 0, msg=errors)
        self.assertNotIn("height_gain", [f["cause"] for f in without["findings"]])
        self.assertIsNotNone(PLUGIN, msg="the plug-in is not built; build the tests")
        with mock.patch.dict(os.environ, MMRADARTWIN_PLUGINS=PLUGIN):
            status, findings, errors = diagnose(self.at("session"), self.at("out"), "--findings", "1")
        self.assertEqual(status, 0, msg=errors)
        first = findings["findings"][0]
        self.assertEqual((first["cause"], first["class"]), ("height_gain", "C3"), msg=str(first))
        assert_told(self, first["parameters"]["db_per_m"], 30.0, msg="db_per_m")
