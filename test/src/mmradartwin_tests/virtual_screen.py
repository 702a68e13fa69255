"""A screen that nobody sees, for programs with windows."""
import os
import subprocess


class VirtualScreen:
    """An Xvfb that draws by itself, without a graphics card. `environment` is for programs that shall appear on it."""

    def __init__(self, width_px, height_px):
        # Xvfb chooses a free number and writes it to the pipe once it takes connections.
        reading, writing = os.pipe()
        self.process = subprocess.Popen(
            ["Xvfb", "-displayfd", str(writing), "-screen", "0", f"{width_px}x{height_px}x24", "+extension", "GLX"],
            pass_fds=[writing], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(writing)
        with os.fdopen(reading) as number:
            self.name = ":" + number.readline().strip()
        if self.name == ":":
            raise OSError("Xvfb has ended before it took connections")
        self.environment = dict(os.environ, DISPLAY=self.name, LIBGL_ALWAYS_SOFTWARE="1")

    def picture(self, file):
        """Writes what the screen shows to a PNG; gives its name."""
        subprocess.run(["import", "-window", "root", file], env=self.environment, check=True, capture_output=True,
                       timeout=60)
        return file

    def close(self):
        self.process.terminate()
        self.process.wait()
