from setuptools import setup

from catkin_pkg.python_setup import generate_distutils_setup

setup(**generate_distutils_setup(
    packages=["mmradartwin_tests", "mmradartwin_tests.blind", "mmradartwin_tests.effects", "mmradartwin_tests.scans",
              "mmradartwin_tests.third_world"], package_dir={"": "src"}))
