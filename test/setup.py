from setuptools import setup

from catkin_pkg.python_setup import generate_distutils_setup

setup(**generate_distutils_setup(
    packages=["mmradartwin_tests", "mmradartwin_tests.blind", "mmradartwin_tests.effects"], package_dir={"": "src"}))
