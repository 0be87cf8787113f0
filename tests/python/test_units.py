"""Units for systemd: systemd-analyze finds no fault in them, and little that they may do beyond their work."""
import configparser
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest
from xml.etree import ElementTree

from live import BIN, BUILD, ROOT

UNITS = ROOT / "deploy/units"
UNPACKED = BUILD / "systemd/usr"
MOST_EXPOSURE = 3.0


def analyze(*arguments):
    """systemd-analyze of this machine, or as deploy/set-up has unpacked it."""
    program, environment = shutil.which("systemd-analyze"), dict(os.environ)
    if program is None:
        program = UNPACKED / "bin/systemd-analyze"
        if not program.exists():
            raise unittest.SkipTest("systemd-analyze is not there (./deploy/set-up unpacks it)")
        environment["LD_LIBRARY_PATH"] = str(next(UNPACKED.glob("lib/*/systemd")))
    return subprocess.run([str(program), "--no-pager", *map(str, arguments)], env=environment, capture_output=True,
                          text=True, timeout=60)


class Units(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="tessera-units-")
        self.addCleanup(folder.cleanup)
        # As installed where the programs are now.
        self.units = []
        for unit in sorted(UNITS.glob("*.service")):
            self.units.append(pathlib.Path(folder.name) / unit.name)
            self.units[-1].write_text(unit.read_text().replace("/usr/bin", str(BIN)))

    def test_systemd_finds_no_fault(self):
        self.assertEqual([unit.name for unit in self.units], ["tessera-client@.service", "tessera-server.service"])
        told = analyze("verify", "--man=no", *self.units)
        self.assertEqual((told.returncode, told.stderr + told.stdout), (0, ""))

    def test_a_fault_would_be_found(self):
        text = self.units[0].read_text()
        self.units[0].write_text(text.replace("ProtectClock=yes", "ProtectClock=perhaps\nProtectTime=yes"))
        told = analyze("verify", "--man=no", self.units[0])
        self.assertRegex(told.stderr, "ProtectTime")

    def test_what_they_may_do_is_little(self):
        for unit in self.units:
            told = analyze("security", "--offline=true", unit)
            exposure = re.search(r"Overall exposure level for \S+: ([\d.]+) ", told.stdout)
            self.assertIsNotNone(exposure, told.stderr)
            self.assertLessEqual(float(exposure.group(1)), MOST_EXPOSURE, unit.name)

    def test_the_options_of_shipped_files_are_good(self):
        """The words of server.conf and client.conf, as systemd would split them, are taken by the programs."""
        text = (UNITS / "server.conf").read_text() + (UNITS / "client.conf").read_text()
        settings = dict(re.findall(r'^(\w+)="?(.*?)"?$', text, re.M))
        with tempfile.TemporaryDirectory() as folder:
            wrong = settings["TESSERA_SERVER_OPTIONS"].replace("1x1", "0x1").split()
            told = subprocess.run([str(BIN / "tessera-server"), *wrong], capture_output=True, text=True, timeout=60,
                                  env={**os.environ, "XDG_RUNTIME_DIR": folder})
        self.assertIn('there is no wall "0x1"', told.stderr)
        options = settings["TESSERA_CLIENT_OPTIONS"].split()
        told = subprocess.run([str(BIN / "tessera-client"), "--check", "--surface", "none", "--server",
                               settings["TESSERA_SERVER"], *options],
                              capture_output=True, text=True, timeout=60)
        self.assertEqual(told.returncode, 0, told.stderr)


class Desktop(unittest.TestCase):
    def test_its_entry_is_good(self):
        if shutil.which("desktop-file-validate") is None:
            self.skipTest("desktop-file-validate is not installed (package desktop-file-utils)")
        told = subprocess.run(["desktop-file-validate", ROOT / "deploy/desktop/tessera.desktop"], capture_output=True,
                              text=True, timeout=60)
        self.assertEqual((told.returncode, told.stdout + told.stderr), (0, ""))

    def test_its_icon_is_there_and_says_its_size(self):
        entry = configparser.ConfigParser(interpolation=None)
        entry.read(ROOT / "deploy/desktop/tessera.desktop")
        icon = ElementTree.parse(ROOT / f"deploy/desktop/{entry['Desktop Entry']['Icon']}.svg").getroot()
        self.assertEqual(icon.get("viewBox"), "0 0 48 48")
        self.assertTrue((BIN / entry["Desktop Entry"]["TryExec"]).exists())


if __name__ == "__main__":
    unittest.main()
