"""The add-on for Blender with 10,000 objects, and with a mesh of a million triangles (blender_cases.py)."""
import unittest

from blender_process import InBlender


class Large(InBlender):
    def test_many_objects(self):
        self.within("blender_cases", "Many")

    def test_a_large_mesh(self):
        self.within("blender_cases", "Large")


if __name__ == "__main__":
    unittest.main()
