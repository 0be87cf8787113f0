"""guarantees.md: the tests that a row names are there, in the program that it names."""
import pathlib
import re
import unittest

TESTS = pathlib.Path(__file__).resolve().parents[1]
TEST = re.compile(r"^(?:TYPED_)?TEST(?:_F|_P)?\((\w+),\s*(\w+)\)", re.MULTILINE)


def names_within():
    """For each program: its suites, its tests, and its files by their names."""
    listed = re.findall(r"^tessera_test\((\w+) ([\w/]+)", (TESTS / "CMakeLists.txt").read_text(), re.MULTILINE)
    programs = {}
    for program, folder in listed:
        names = set()
        for path in (TESTS / folder).glob("*.cpp"):
            names.update(name for pair in TEST.findall(path.read_text()) for name in pair)
            names.add(path.stem)
        programs[program] = names
    programs["python"] = {path.stem.removeprefix("test_") for path in (TESTS / "python").glob("test_*.py")}
    programs["fuzz"] = {path.name for path in (TESTS / "fuzz" / "corpus").iterdir()}
    return programs


def rows():
    for line in (TESTS / "guarantees.md").read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in line.strip("|").split(" | ")]
        if line.startswith("|") and len(cells) == 3:
            yield cells[0], cells[2]


class Guarantees(unittest.TestCase):
    def test_each_names_tests_that_are_there(self):
        programs, looked = names_within(), 0
        for guarantee, shown in rows():
            named = re.findall(r"`(\w+)\.(\w+)", shown)
            for program, words in re.findall(r"`(\w+)` \(([^)]*)\)", shown):
                # Words in small letters say how: "seeds", "random histories".
                named += [(program, word) for word in re.findall(r"\b[A-Z]\w+", words)]
            for program, name in named:
                if program not in programs:
                    continue
                looked += 1
                self.assertTrue(any(known.startswith(name) for known in programs[program]),
                                f"{guarantee}\n`{program}` has no {name}")
        self.assertGreater(looked, 250)


if __name__ == "__main__":
    unittest.main()
