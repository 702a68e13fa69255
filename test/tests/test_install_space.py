"""What `catkin_make install` would leave is whole: the built workspace is installed into a folder of its own, and programs
run from there without sources and devel space."""
import os
import shutil
import socket
import subprocess
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
DEVEL = os.environ.get("CMAKE_PREFIX_PATH", "").split(os.pathsep)[0]
BUILD = os.path.join(os.path.dirname(DEVEL), "build")
PACKAGES = ["attribution", "config", "driver", "dsp", "launch", "msgs", "sim", "tests"]

# Prints "LAUNCH PACKAGE TYPE PROGRAM" of every node of launch files of mmradartwin_launch, each given with its arguments.
NODES_OF = """
import sys
import roslaunch.config
import roslaunch.rlutil
import roslib.packages
for text in sys.argv[1:]:
    name, *arguments = text.split()
    file = roslaunch.rlutil.resolve_launch_arguments(["mmradartwin_launch", name])[0]
    for node in roslaunch.config.load_config_default([(file, arguments)], None).nodes:
        print(name, node.package, node.type, *roslib.packages.find_node(node.package, node.type))
"""


def modules_below(folder):
    """Names of mmradartwin_tests' modules in a folder that holds it."""
    names = set()
    for at, _, files in os.walk(os.path.join(folder, "mmradartwin_tests")):
        package = os.path.relpath(at, folder).replace(os.sep, ".")
        names |= {package if file == "__init__.py" else f"{package}.{file[:-3]}" for file in files if file.endswith(".py")}
    return names


@unittest.skipUnless(os.path.isfile(os.path.join(BUILD, "cmake_install.cmake")), "the workspace is not catkin_make's")
class InstallSpace(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.stage = tempfile.mkdtemp(prefix="mmradartwin_install_")
        cls.installed = subprocess.run(["cmake", "--install", BUILD], env=dict(os.environ, DESTDIR=cls.stage),
                                       capture_output=True, text=True, timeout=600, check=False)
        with open(os.path.join(BUILD, "CMakeCache.txt"), encoding="utf-8") as cache:
            prefix = next(line.split("=", 1)[1].strip() for line in cache if line.startswith("CMAKE_INSTALL_PREFIX:"))
        cls.prefix = cls.stage + prefix

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.stage, ignore_errors=True)

    def run_there(self, command, timeout_s=120):
        """Standard output of a command in the install space; nothing of this process' environment is seen."""
        environment = {"HOME": self.stage, "PATH": "/usr/bin:/bin", "LANG": "C.UTF-8", "ROS_LOG_DIR": self.stage + "/log",
                       "ROS_MASTER_URI": "http://127.0.0.1:1", "ROS_IP": "127.0.0.1"}
        run = subprocess.run(["bash", "-c", f"source '{self.prefix}/setup.bash' && {command}"], env=environment,
                             cwd=self.stage, capture_output=True, text=True, timeout=timeout_s, check=False)
        self.assertEqual(run.returncode, 0, f"{command}\n{run.stdout[-2000:]}{run.stderr[-3000:]}")
        return run.stdout

    def test_installing_ends_well(self):
        self.assertEqual(self.installed.returncode, 0, self.installed.stderr[-3000:])

    def test_packages_and_libraries_are_found_there(self):
        found = self.run_there("for p in " + " ".join(PACKAGES) + "; do rospack find mmradartwin_$p; done").split()
        self.assertEqual(len(found), len(PACKAGES))
        for folder in found:
            self.assertTrue(folder.startswith(self.prefix), folder)
        linked = self.run_there(f"ldd '{self.prefix}/lib/mmradartwin_attribution/diagnose'")
        ours = [line for line in linked.splitlines() if "libmmradartwin" in line]
        self.assertGreaterEqual(len(ours), 3)
        for line in ours:
            self.assertIn(self.prefix, line)

    def test_every_module_of_the_generator_is_installed_and_can_be_imported(self):
        source = modules_below(os.path.join(ROOT, "test", "src"))
        self.assertGreater(len(source), 20)
        there = os.path.join(self.prefix, "lib", "python3", "dist-packages")
        self.assertEqual(modules_below(there), source)
        self.run_there("python3 -c 'import " + ", ".join(sorted(source)) + "'")

    def make_session(self):
        self.run_there("rosrun mmradartwin_tests make_session.py --output session --seed 3 --locations 1 --headings 1 "
                       "--frames 4 --effect actor_moved --truth truth.json --force")

    def test_a_session_is_made_simulated_and_evaluated_there(self):
        self.make_session()
        self.run_there("rosrun mmradartwin_sim simulate session --output simulated")
        self.run_there("rosrun mmradartwin_attribution evaluate session --output report")
        self.assertTrue(os.path.isfile(os.path.join(self.stage, "report", "report.html")))
        self.run_there('cp -r "$(rospack find mmradartwin_attribution)/report" templates && '
                       "rosrun mmradartwin_attribution evaluate session --report-templates templates --output again")

    def test_a_bag_is_replayed_there(self):
        self.make_session()
        self.run_there("rosrun mmradartwin_dsp session_to_bag session replayed.bag")
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        said = self.run_there(f"export ROS_MASTER_URI=http://127.0.0.1:{port} && timeout -s INT 100 roslaunch -p {port} "
                              "mmradartwin_launch replay.launch bag:=$PWD/replayed.bag rviz:=false diagnosis:=false "
                              "stay:=false rate:=5")
        self.assertRegex(said, r"twin of .*: \d+ actors, \d+ facets")

    def test_the_demos_scripts_stand_beside_what_they_call(self):
        for script in ("demo.sh", "try.sh"):
            self.assertIn("usage: " + script, self.run_there(f"rosrun mmradartwin_launch {script} --help"))
        folder = os.path.join(self.prefix, "lib", "mmradartwin_launch")
        for name in ("stages.sh", "tell_result.py", "emulated_rig.sh", "recorder.py", "ros_master.py"):
            self.assertTrue(os.path.isfile(os.path.join(folder, name)), name)

    def test_every_node_of_the_launch_files_is_found_there(self):
        program = os.path.join(self.stage, "nodes_of.py")
        with open(program, "w", encoding="utf-8") as file:
            file.write(NODES_OF)
        launches = ["demo.launch session:=/s bag:=/b", "replay.launch bag:=/b", "live.launch rig:=emulated",
                    "record.launch", "inspect.launch results:=/r"]
        lines = self.run_there(f"python3 '{program}' " + " ".join(f"'{launch}'" for launch in launches)).splitlines()
        self.assertGreater(len(lines), 20)
        ours = 0
        for line in lines:
            launch, package, kind, *found = line.split()
            self.assertTrue(found, f"{launch}: {package} {kind} is not installed")
            if package.startswith("mmradartwin_"):
                ours += 1
                self.assertTrue(found[0].startswith(self.prefix), line)
        self.assertGreater(ours, 10)


if __name__ == "__main__":
    unittest.main()
