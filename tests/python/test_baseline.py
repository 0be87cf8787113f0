"""What is compiled runs on every processor of Debian's amd64: what asks for more is a kernel, chosen at run time."""
import json
import pathlib
import re
import shlex
import subprocess
import unittest

from live import BUILD, ROOT

KERNEL = re.compile(r"(Avx2|Avx512|Sse41)\.cpp$")
BEYOND = re.compile(r"-m(arch|cpu|tune)=.*|-m(avx|fma|bmi|sse3|ssse3|sse4|f16c|popcnt|lzcnt|movbe|aes|sha|vaes|gfni).*")


class Baseline(unittest.TestCase):
    def setUp(self):
        self.commands = json.loads((BUILD / "compile_commands.json").read_text())

    def test_kernels_alone_ask_for_more_than_the_baseline(self):
        kernels = 0
        for command in self.commands:
            beyond = [word for word in shlex.split(command["command"]) if BEYOND.fullmatch(word)]
            if beyond and pathlib.Path(command["file"]).is_relative_to(ROOT):
                self.assertRegex(command["file"], KERNEL, f"compiled with {beyond}")
                kernels += 1
        self.assertGreater(kernels, 10)

    def test_no_kernel_lends_its_functions_to_others(self):
        """A function that several files define comes from any of them: from a kernel it stops an older processor."""
        for command in self.commands:
            if not KERNEL.search(command["file"]):
                continue
            words = shlex.split(command["command"])
            made = pathlib.Path(command["directory"]) / words[words.index("-o") + 1]
            symbols = subprocess.run(["nm", "--defined-only", str(made)], capture_output=True, text=True,
                                     check=True).stdout
            self.assertEqual([line for line in symbols.splitlines() if re.search(r" [WVu] ", line)], [], str(made))


if __name__ == "__main__":
    unittest.main()
