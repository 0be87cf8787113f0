"""The add-on for Blender in a random storm of edits on both sides (blender_storm.py)."""
import unittest

from blender_process import InBlender


class BlenderStorm(InBlender):
    def test_both_sides_are_the_same_after_it(self):
        self.within("blender_storm")


if __name__ == "__main__":
    unittest.main()
