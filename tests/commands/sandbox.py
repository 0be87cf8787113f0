"""A copy of the tree whose build folder is empty, and is built in seconds: the scripts, CMake and ninja are the real
ones, the compiler is not."""
import os
import shutil
import subprocess

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
# What deploy/set-up unpacks: it would fetch it from Debian, or from npm.
UNPACKED = ("boost", "cgal", "osd", "sdl", "sshd", "sshd-libraries", "systemd", "npm")


class Sandbox:
    def __init__(self, folder, built):
        """`built`: the build folder that the copies of programs come from."""
        self.root = folder
        self.build = os.path.join(folder, "build")
        self.built = built
        self.environment = dict(os.environ, TESSERA_BUILT=os.path.join(built, "bin"), PYTHONDONTWRITEBYTECODE="1",
                                SANDBOX="1",
                                TESSERA_CMAKE_OPTIONS=f"-DTESSERA_CCACHE={HERE}/stand-in "
                                                      f"-DCMAKE_CXX_LINKER_LAUNCHER={HERE}/stand-in")
        self.environment.pop("TESSERA_BUILD", None)

    def make(self):
        shutil.rmtree(self.root, ignore_errors=True)
        os.makedirs(self.build)
        for entry in sorted(os.listdir(ROOT)):
            if not entry.startswith((".", "build")) and entry not in ("out", "__pycache__"):
                os.symlink(os.path.join(ROOT, entry), os.path.join(self.root, entry))
        for name in UNPACKED:
            if os.path.exists(os.path.join(self.built, name)):
                os.symlink(os.path.join(self.built, name), os.path.join(self.build, name))


    def remove(self):
        shutil.rmtree(self.root, ignore_errors=True)
