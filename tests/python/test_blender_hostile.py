"""The add-on for Blender at the wrong moment, and where both sides change the same; what is claimed stands in the files
named here."""
import unittest

from blender_process import InBlender


class BlenderHostile(InBlender):
    def test_what_comes_at_the_wrong_moment(self):
        self.within("blender_awkward")

    def test_what_both_sides_change_at_once(self):
        self.within("blender_both_sides")

    def test_what_moves_while_both_sides_are_compared(self):
        self.within("blender_rest")


if __name__ == "__main__":
    unittest.main()
