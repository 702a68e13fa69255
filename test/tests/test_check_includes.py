"""The include rule on trees made for it: each arrow that is forbidden is found, and no other."""
import os
import runpy
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

HERE = Path(os.path.realpath(__file__)).parent
PROGRAM = HERE.parent / "scripts" / "check_includes.py"
DIAGNOSIS = "mmradartwin_attribution/src/diagnosis"
SIM = "mmradartwin_sim/src"
MECHANISMS = f"{SIM}/mechanisms"
ROOMS = runpy.run_path(str(PROGRAM))["ROOMS"]


class CheckIncludes(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = Path(folder.name)
        # A room of a table without files is told: each has one here, whatever tables and rooms there are. A room with
        # rooms of its own has theirs.
        for folder, rooms in ROOMS.items():
            for room in rooms:
                if f"{folder}/{room}" not in ROOMS:
                    self.write(f"{folder}/{room}/{room}_{'mechanism' if folder == MECHANISMS else 'unit'}.h", "<vector>")
        self.write(f"{DIAGNOSIS}/rooms.h")
        self.write("mmradartwin_dsp/include/mmradartwin_dsp/session.h", "<string>")
        self.write("mmradartwin_dsp/include/mmradartwin_dsp/ros/bag.h", "<rosbag/bag.h>", '"mmradartwin_dsp/session.h"')

    def write(self, file, *includes):
        path = self.root / file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("".join(f"#include {include}\n" for include in includes), encoding="utf-8")

    def run_program(self, *arguments):
        return subprocess.run([sys.executable, str(PROGRAM), str(self.root), *arguments], capture_output=True, text=True,
                              check=False)

    def assert_allowed(self):
        result = self.run_program()
        self.assertEqual((result.returncode, result.stderr), (0, ""), result.stdout)

    def assert_forbidden(self, file, *words):
        result = self.run_program()
        self.assertEqual(result.returncode, 1, result.stdout)
        lines = result.stdout.splitlines()
        self.assertEqual(len(lines), 1, result.stdout)
        for word in (file, *words):
            self.assertIn(word, lines[0])

    def test_tree_without_forbidden_arrows_passes(self):
        self.write(f"{DIAGNOSIS}/rounds/selection.cpp", '"diagnosis/search/search_unit.h"', '"diagnosis/rooms.h"',
                   '"diagnosis/numbers/numbers_unit.h"', '"mmradartwin_dsp/session.h"')
        self.write(f"{DIAGNOSIS}/diagnosis.cpp", '"diagnosis/rounds/rounds_unit.h"', '"diagnosis/report/report_unit.h"')
        self.write("mmradartwin_sim/nodes/twin_node.cpp", "<ros/ros.h>", '"mmradartwin_dsp/ros/bag.h"')
        self.assert_allowed()

    def test_room_may_not_include_a_room_above_it(self):
        file = f"{DIAGNOSIS}/numbers/median.cpp"
        self.write(file, '"diagnosis/search/search_unit.h"')
        self.assert_forbidden(file, "numbers may not see search")

    def test_room_may_not_include_a_room_beside_it(self):
        file = f"{DIAGNOSIS}/gain/held_out.cpp"
        self.write(file, '"../search/search_unit.h"')
        self.assert_forbidden(file, "gain may not see search")

    def test_room_may_not_include_the_conductor(self):
        self.write(f"{DIAGNOSIS}/survey_plan.h")
        file = f"{DIAGNOSIS}/report/figure.cpp"
        self.write(file, '"diagnosis/survey_plan.h"')
        self.assert_forbidden(file, "report may not see the files beside the rooms")

    def test_public_header_belongs_to_the_room_of_its_source(self):
        self.write(f"{DIAGNOSIS}/rounds/plan.cpp", '"mmradartwin_attribution/plan.h"')
        self.write("mmradartwin_attribution/include/mmradartwin_attribution/plan.h", "<vector>")
        file = f"{DIAGNOSIS}/channels/channel_data.cpp"
        self.write(file, '"mmradartwin_attribution/plan.h"')
        self.assert_forbidden(file, "channels may not see rounds")

    def test_twin_and_mechanisms_meet_in_the_stages_alone(self):
        twin, mechanism = f"{SIM}/twin/twin.cpp", f"{SIM}/mechanisms/array/coupling.cpp"
        self.write(twin, '"stages/stages_unit.h"', '"rays/rays_unit.h"')
        self.write(mechanism, '"stages/stages_unit.h"', '"physics/physics_unit.h"', '"mechanisms/base/base_mechanism.h"')
        self.assert_allowed()
        self.write(twin, '"mechanisms/base/base_mechanism.h"')
        self.assert_forbidden(twin, "twin may not see mechanisms")
        self.write(twin)
        self.write(mechanism, '"twin/twin_unit.h"')
        self.assert_forbidden(mechanism, "mechanisms may not see twin")

    def test_scene_may_not_include_what_is_computed_in_it(self):
        file = f"{SIM}/scene/facet_builder.cpp"
        for room in ("records", "rays", "physics", "echoes"):
            with self.subTest(room):
                self.write(file, f'"{room}/{room}_unit.h"')
                self.assert_forbidden(file, f"scene may not see {room}")

    def test_mechanism_may_not_include_one_of_another_kind(self):
        file = f"{SIM}/mechanisms/frames/noise.cpp"
        self.write(file, '"mechanisms/array/array_mechanism.h"')
        self.assert_forbidden(file, "frames may not see array")

    def test_public_header_without_source_has_the_room_that_the_table_says(self):
        self.write("mmradartwin_sim/include/mmradartwin_sim/mechanism_stages.h", "<vector>")
        self.write(f"{SIM}/twin/twin.cpp", '"mmradartwin_sim/mechanism_stages.h"')
        self.assert_allowed()
        file = f"{SIM}/physics/aperture.cpp"
        self.write(file, '"mmradartwin_sim/mechanism_stages.h"')
        self.assert_forbidden(file, "physics may not see stages")

    def test_public_header_of_no_room_is_told(self):
        file = "mmradartwin_sim/include/mmradartwin_sim/attic.h"
        self.write(file, "<vector>")
        self.assert_forbidden(file, "of no room")
        self.write(f"{SIM}/twin/attic.cpp", '"mmradartwin_sim/attic.h"')
        self.assert_allowed()

    def test_circle_of_units_is_told(self):
        src = "mmradartwin_driver/src"
        self.write(f"{src}/rig.h")
        self.write(f"{src}/rig.cpp", '"rig.h"', '"watch.h"')
        self.write(f"{src}/watch.h", '"clock.h"')
        self.write(f"{src}/clock.h")
        self.assert_allowed()
        # No file includes itself: the circle is of headers with their sources.
        self.write(f"{src}/clock.cpp", '"clock.h"', '"rig.h"')
        self.assert_forbidden(f"{src}/clock", "in a circle", f"{src}/clock, {src}/rig, {src}/watch")

    def test_unknown_room_is_told(self):
        self.write(f"{DIAGNOSIS}/attic/old.cpp", "<vector>")
        self.assert_forbidden(f"{DIAGNOSIS}/attic", "the table does not have")

    def test_package_may_not_include_one_that_depends_on_it(self):
        self.write("mmradartwin_sim/include/mmradartwin_sim/twin.h", "<vector>")
        self.write(f"{SIM}/twin/twin.cpp", '"mmradartwin_sim/twin.h"')
        file = "mmradartwin_dsp/apps/process.cpp"
        self.write(file, '"mmradartwin_sim/twin.h"')
        self.assert_forbidden(file, "mmradartwin_dsp does not depend on mmradartwin_sim")

    def test_library_may_not_include_ros(self):
        for number, name in enumerate(("<ros/ros.h>", "<tf2_ros/buffer.h>", "<sensor_msgs/Imu.h>",
                                       '"mmradartwin_msgs/AdcCube.h"', '"mmradartwin_dsp/ros/bag.h"')):
            with self.subTest(name):
                file = "mmradartwin_driver/src/rig.cpp"
                self.write(file, name)
                self.assert_forbidden(file, "free of ROS")
                self.write(file, f"<vector{number}>")
        self.write("mmradartwin_driver/src/ros/rig_node.cpp", "<ros/ros.h>", '"mmradartwin_msgs/AdcCube.h"')
        self.assert_allowed()

    def test_levels_count_the_longest_chain_and_circles(self):
        src = "mmradartwin_driver/src"
        self.write(f"{src}/a.h", '"b.h"')
        self.write(f"{src}/b.h", '"c.h"')
        self.write(f"{src}/c.h")
        self.write(f"{src}/c.cpp", '"c.h"', '"d.h"')
        self.write(f"{src}/d.h", '"c.h"')
        result = self.run_program("--levels")
        self.assertEqual(result.returncode, 0, result.stderr)
        # a over b over the circle of c and d.
        self.assertIn("mmradartwin_driver  4  3  4  1\n", result.stdout)
        self.assertIn("circle: src/c, src/d", result.stdout)

    def write_unnamed(self, file, *lines):
        path = self.root / file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("\n".join(["namespace mmradartwin {", "namespace {", *lines, "}  // namespace", "}", ""]), encoding="utf-8")

    def test_names_of_one_folder_belong_to_one_source(self):
        for first, second in [("constexpr int kOther = 1, kMost = 2;", "constexpr double kMost = 3;  // m"),
                              ("double kMost(double x) {", "std::vector<int> kMost(const std::vector<int>& x) {"),
                              ("struct kMost {", "class kMost : public Base {")]:
            self.write_unnamed(f"{SIM}/rays/one.cpp", first)
            self.write_unnamed(f"{SIM}/rays/two.cpp", "  // kMost", second)
            self.assert_forbidden(f"{SIM}/rays/two.cpp", "kMost", f"{SIM}/rays/one.cpp")
            self.write_unnamed(f"{SIM}/rays/two.cpp", "constexpr int kLeast = 0;  // kMost", "  const int kMost = 1;")
            self.assert_allowed()
            self.write_unnamed(f"{SIM}/physics/two.cpp", second)
            self.assert_allowed()


if __name__ == "__main__":
    unittest.main()
