"""What shells complete programs' words by, in bash itself; zsh and fish read theirs where they are installed."""
import os
import pathlib
import shutil
import subprocess
import unittest

BIN = pathlib.Path(os.environ.get("TESSERA_BUILD", pathlib.Path(__file__).resolve().parents[2] / "build")) / "bin"
NOT_FOR_PEOPLE = ("tessera-drill", "tessera-import", "tessera-import-coin", "tessera-decode-film",
                  "tessera-try-program")
PROGRAMS = [path.name for path in sorted(BIN.glob("tessera-*")) if path.name not in NOT_FOR_PEOPLE]


def run(command, **options):
    return subprocess.run(command, capture_output=True, text=True, timeout=30, **options)


def script(program, shell):
    return run([BIN / program, "--completion", shell], check=True).stdout


def completed(*words):
    """What bash offers behind these words, the last of which has just begun."""
    said = " ".join(f"'{word}'" for word in words)
    lines = (script(words[0], "bash") + f"COMP_WORDS=({said}); COMP_CWORD={len(words) - 1}\ncompopt() {{ :; }}\n"
             f"_{words[0].replace('-', '_')}\nprintf '%s\\n' \"${{COMPREPLY[@]}}\"\n")
    return run(["bash", "-u"], input=lines, check=True).stdout.split()


class Completion(unittest.TestCase):
    def test_bash_offers_options_their_words_and_verbs(self):
        self.assertEqual(completed("tessera-server", "--reco"), ["--record"])
        self.assertEqual(completed("tessera-server", "--up", ""), ["y", "z"])
        self.assertIn("undo", completed("tessera-ctl", "und"))
        self.assertEqual(completed("tessera-ctl", "move", "--b"), ["--by"])
        self.assertNotIn("--by", completed("tessera-ctl", "status", "--"), "it is another verb's")
        self.assertEqual(completed("tessera-ctl", "--server", ""), [], "nobody knows")

    def test_every_shell_reads_its_script(self):
        shells = [shell for shell in ("bash", "zsh", "fish") if shutil.which(shell)]
        for program in PROGRAMS:
            for shell in shells:
                with self.subTest(program=program, shell=shell):
                    done = run([shell, "-n"], input=script(program, shell))
                    self.assertEqual((done.returncode, done.stderr), (0, ""))

    def test_another_shell_is_refused_in_words(self):
        done = run([BIN / "tessera-server", "--completion", "ksh"])
        self.assertEqual(done.returncode, 2)
        self.assertIn("--completion: ksh not in {bash,zsh,fish}", done.stderr)


if __name__ == "__main__":
    unittest.main()
