"""The add-on for Blender (deploy/blender), within Debian's Blender without a window, before walls of real processes.
What is claimed stands in blender_cases.py."""
import unittest

from blender_process import InBlender


class Blender(InBlender):
    def test_what_is_shown(self):
        self.within("blender_cases", "Shown")

    def test_both_ways(self):
        self.within("blender_cases", "BothWays")

    def test_undo_is_kept_apart(self):
        self.within("blender_cases", "Undo")

    def test_who_is_not_let_in(self):
        self.within("blender_cases", "NotLetIn")


if __name__ == "__main__":
    unittest.main()
