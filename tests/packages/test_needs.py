#!/usr/bin/env python3
"""What is needed is installed (`needs`), and each kind of need is noticed: without its package, it is named.

usage: test_needs.py BUILD"""
import importlib.machinery
import importlib.util
import pathlib
import sys
import unittest

HERE = pathlib.Path(__file__).resolve().parent
sys.dont_write_bytecode = True
LOADER = importlib.machinery.SourceFileLoader("needs", str(HERE / "needs"))
needs = importlib.util.module_from_spec(importlib.util.spec_from_loader("needs", LOADER))
LOADER.exec_module(needs)
BUILD = pathlib.Path(sys.argv.pop(1)) if len(sys.argv) > 1 else HERE.parents[1] / "build"


class Needs(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.packages, cls.listed = needs.Packages(), staticmethod(needs.listed)

    def tearDown(self):
        needs.listed = type(self).listed

    def faults(self, without=""):
        needs.listed = lambda *options: [name for name in type(self).listed(*options) if name != without]
        return sorted(set(needs.faults(self.packages, BUILD)))

    def test_each_thing_that_is_used_is_of_a_listed_package(self):
        self.assertEqual("\n".join(self.faults()), "")

    def test_a_header_without_its_package_is_named(self):
        self.assertIn("/usr/include/gmock/gmock.h", "\n".join(self.faults("libgmock-dev")))

    def test_a_program_without_its_package_is_named(self):
        self.assertIn("test_sealed.py", "\n".join(one for one in self.faults("curl") if "curl is of curl" in one))

    def test_a_module_without_its_package_is_named(self):
        self.assertTrue([one for one in self.faults("python3-selenium") if "page_browser.py" in one])


if __name__ == "__main__":
    unittest.main()
