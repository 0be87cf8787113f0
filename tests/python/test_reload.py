"""Files that change on disk while a wall of real processes shows them: what is taken in again, and what people keep."""
import json
import os
import struct
import threading
import unittest

import tessera
from eventually import eventually
from live import PATIENCE, Live, run_folder


def hall(crane=(1, 0, 0), crate=(2, 0, 0), size=1.0, more=""):
    place = "transform {{ translation {{ x: {} y: {} z: {} }} }}".format
    return f"""
node {{ name: "hall" {place(0, 0, 0)}
  node {{ name: "crane" {place(*crane)} node {{ name: "shape" box {{ size {{ x: {size} y: 1 z: 1 }} }} }} }}
  node {{ name: "crate" {place(*crate)} }}
  {more}
}}
"""


def triangle(height):
    """A model and its array, in two files."""
    array = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, height, 0)
    model = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"name": "sail", "mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0],
                       "max": [1, height, 0]}],
        "bufferViews": [{"buffer": 0, "byteLength": len(array)}],
        "buffers": [{"uri": "sail.bin", "byteLength": len(array)}],
    }
    return json.dumps(model), array


def replace(path, text):
    """As editors do: whoever looks sees the old file or the new one."""
    beside = path.with_name(path.name + ".new")
    beside.write_text(text)
    os.replace(beside, path)


def wait_until(holds, what):
    if not eventually(holds):
        raise AssertionError(f"{what}: not within {PATIENCE} s")


class Changing(Live):
    """Its scene lies in a folder of its own."""

    def __init__(self, text, options=("--reload",), name="hall.tsct", **others):
        super().__init__(surface="none", options=options, **others)
        self.files = self.folder / "files"
        self.files.mkdir()
        self._scene = self.file = self.files / name
        self.file.write_text(text)

    def said(self, words):
        return self.log("server").count(words)


class Rewriting:
    """Replaces a hall faster than it could rest, its crate ever farther away."""

    def __init__(self, file):
        self._file, self._enough, self.last = file, threading.Event(), 9
        self._thread = threading.Thread(target=self._work, daemon=True)

    def _work(self):
        while not self._enough.wait(0.03):
            self.last += 1
            replace(self._file, hall(crate=(self.last, 0, 0)))

    def stop(self):
        self._enough.set()
        self._thread.join()

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, kind, value, trace):
        self.stop()


def place(wall, path):
    return tuple(float(x) for x in wall[path].translation)


class Reload(unittest.TestCase):
    def setUp(self):
        self.enterContext(run_folder())

    def test_a_file_that_is_replaced_is_taken_in_again_and_what_people_moved_stays(self):
        with Changing(hall()) as live, live.connect() as wall:
            ids = {path: wall[path].id for path in ("/hall/crane", "/hall/crate", "/hall/crane/shape")}
            wall["/hall/crane"].translation = (7, 7, 7)
            replace(live.file, hall(crate=(3, 0, 0)))
            wait_until(lambda: place(wall, "/hall/crate") == (3, 0, 0), "the crate moves")
            self.assertEqual(place(wall, "/hall/crane"), (7, 7, 7), "the file has not touched it")
            replace(live.file, hall(crane=(5, 0, 0), crate=(4, 0, 0), more='node { name: "lamp" }'))
            wait_until(lambda: place(wall, "/hall/crate") == (4, 0, 0), "the crate moves again")
            self.assertEqual(place(wall, "/hall/crane"), (7, 7, 7), "both have changed it")
            wait_until(lambda: live.said("the Transform of /hall/crane: translation stays as it is here") == 1,
                       "that is named")
            self.assertEqual([child.name for child in wall["/hall"].children], ["crane", "crate", "lamp"])
            for path, number in ids.items():
                self.assertEqual(wall[path].id, number, f"{path} is the same node")
            wall.undo()
            self.assertEqual(place(wall, "/hall/crane"), (1, 0, 0), "undo takes back what the person did")
            self.assertEqual(place(wall, "/hall/crate"), (4, 0, 0), "and nothing of the file")
            with self.assertRaises(tessera.Refused):
                wall.undo()

    def test_a_file_that_is_broken_changes_nothing_and_is_watched_on(self):
        with Changing(hall()) as live, live.connect() as wall:
            with open(live.file, "w") as file:  # cut off, then written where it lies
                file.write(hall(crate=(3, 0, 0))[:60])
            wait_until(lambda: live.said("what it held before stays") == 1, "that is said")
            self.assertEqual(place(wall, "/hall/crate"), (2, 0, 0))
            with open(live.file, "w") as file:
                file.write(hall(crate=(3, 0, 0)))
            wait_until(lambda: place(wall, "/hall/crate") == (3, 0, 0), "whole again")
            live.file.unlink()
            wait_until(lambda: live.said("it is gone; what it held stays") == 1, "that is said, too")
            self.assertEqual(place(wall, "/hall/crate"), (3, 0, 0))
            live.file.write_text(hall(crate=(6, 0, 0)))
            wait_until(lambda: place(wall, "/hall/crate") == (6, 0, 0), "back")
            # Quickly one after the other: the last one counts.
            for x in range(10, 20):
                replace(live.file, hall(crate=(x, 0, 0)))
            wait_until(lambda: place(wall, "/hall/crate") == (19, 0, 0), "the last one")
            self.assertEqual(live.said("what it held before stays"), 1, live.log("server"))

    def test_a_file_that_never_rests_is_read_still(self):
        with Changing(hall()) as live, live.connect() as wall, Rewriting(live.file) as writing:
            wait_until(lambda: place(wall, "/hall/crate")[0] >= 10, "some of it is seen")
            writing.stop()
            wait_until(lambda: place(wall, "/hall/crate")[0] == writing.last, "the last one")

    def test_whatever_comes_in_the_place_of_a_file_changes_nothing(self):
        def cut(file):
            file.write_bytes(file.read_bytes()[:len(file.read_bytes()) // 2])

        def become(make):
            def work(file):
                file.unlink()
                make(file)
            return work

        wrong = {
            "cut": cut, "empty": lambda file: file.write_bytes(b""),
            "noise": lambda file: file.write_bytes(bytes(range(256)) * 40),
            "letter": lambda file: file.write_text("this is a letter, not a model"),
            "many": lambda file: file.write_text("node { " * 5000),
            "folder": become(lambda file: file.mkdir()), "pipe": become(os.mkfifo),
            "device": become(lambda file: file.symlink_to("/dev/zero")),
            "loop": become(lambda file: file.symlink_to(file.name)),
        }
        for name, text in (("hall.tsct", hall()), ("sail.gltf", triangle(1.0)[0])):
            live = Changing(text, name=name)
            (live.files / "sail.bin").write_bytes(triangle(1.0)[1])
            with self.subTest(name), live, live.connect() as wall:
                def shape():
                    return (wall.find("/**", type="Geometry")[0].positions[2][1] if name == "sail.gltf"
                            else place(wall, "/hall/crate")[0])

                def good(number):
                    if live.file.is_dir():
                        live.file.rmdir()
                    (live.files / "sail.bin").write_bytes(triangle(number)[1])
                    replace(live.file, triangle(number)[0] if name == "sail.gltf" else hall(crate=(number, 0, 0)))
                    wait_until(lambda: shape() == number, f"a good file is taken in: {number}")

                number, before = 1.0, shape()
                for what, work in wrong.items():
                    with self.subTest(what):
                        said = live.said("stays") + live.said("it is gone")
                        work(live.file)
                        wait_until(lambda: live.said("stays") + live.said("it is gone") > said, f"{what}: that is said")
                        self.assertEqual(shape(), before)
                        number += 1
                        good(number)
                        before = number
                if name == "sail.gltf":
                    said = live.said("stays")
                    (live.files / "sail.bin").unlink()
                    wait_until(lambda: live.said("stays") > said, "an array is missing: that is said")
                    self.assertEqual(shape(), before)
                    good(number + 1)
                self.assertIsNone(live.server.poll())

    def test_a_link_that_comes_to_lead_outside_is_not_followed(self):
        live = Changing(hall(more='node { name: "inner" inline { file: "inner.tsct" } }'))
        models, outside = live.folder / "models", live.folder / "outside"
        models.mkdir()
        outside.mkdir()
        secret = 'node { name: "secret" }'
        (outside / "box.tsct").write_text(secret)
        file, inner = models / "box.tsct", live.files / "inner.tsct"
        file.write_text('node { name: "box" }')
        inner.write_text('node { name: "within" }')
        live._options += ["--allow", str(models)]
        with live, live.connect() as wall:
            wall.load(str(file))
            wait_until(lambda: list(wall.find("/**/within")), "the Inline's file is there")
            for one in (file, inner):
                said = live.said("stays")
                link = one.with_name("link")
                link.symlink_to(outside / "box.tsct")
                os.replace(link, one)
                wait_until(lambda: live.said("stays") > said, f"{one}: that is said")
            self.assertFalse(list(wall.find("/**/secret")))
            self.assertTrue(list(wall.find("/**/box")) and list(wall.find("/**/within")), "what they held stays")
            replace(file, 'node { name: "box" node { name: "more" } }')
            wait_until(lambda: list(wall.find("/**/more")), "a good file is taken in")

    def test_a_step_whose_nodes_have_gone_with_the_file_is_forgotten_in_words(self):
        with Changing(hall()) as live, live.connect() as wall:
            wall.remove("/hall/crate")
            wall.undo()
            replace(live.file, hall().replace('node { name: "crate"', 'node { name: "barrel"'))
            wait_until(lambda: list(wall.find("/**/barrel")), "the crate has gone with the file")
            with self.assertRaises(tessera.Refused) as refused:
                wall.redo()
            self.assertIn("is forgotten", str(refused.exception))
            self.assertEqual(wall.status().redo_depth, 0)

    def test_files_that_a_file_names_are_watched_too(self):
        text, array = triangle(1.0)
        live = Changing(text, name="sail.gltf")
        (live.files / "sail.bin").write_bytes(array)
        with live, live.connect() as wall:
            (shape,) = wall.find("/**", type="Geometry")
            self.assertEqual(shape.positions[2][1], 1.0)
            (live.files / "sail.bin").write_bytes(triangle(2.0)[1])
            wait_until(lambda: shape.positions[2][1] == 2.0, "the sail is higher")

    def test_what_an_inline_holds_is_taken_in_again(self):
        text = hall(more='node { name: "inner" inline { file: "inner.tsct" } }')
        live = Changing(text)
        inner = live.files / "inner.tsct"
        inner.write_text(hall())
        with live, live.connect() as wall:
            path = "/hall/inner/hall/crate"
            wait_until(lambda: any(node.path == path for node in wall.find("/**/crate")), "it is there")
            number = wall[path].id
            replace(inner, hall(crate=(5, 0, 0)))
            wait_until(lambda: place(wall, path) == (5, 0, 0), "the crate moves")
            self.assertEqual(wall[path].id, number)
            replace(live.file, hall())
            wait_until(lambda: not list(wall.find("/**/inner")), "the Inline goes, and what it held")
            self.assertEqual(len(list(wall.find("/**/crate"))), 1)

    def test_what_has_changed_while_it_was_removed_is_read_when_it_is_back(self):
        live = Changing(hall(more='node { name: "inner" inline { file: "inner.tsct" } }'))
        inner = live.files / "inner.tsct"
        inner.write_text(hall())
        with live, live.connect() as wall:
            wait_until(lambda: list(wall.find("/hall/inner/hall/crate")), "it is there")
            wall.remove("/hall/inner")
            replace(inner, hall(crate=(5, 0, 0)))
            replace(live.file, hall(crate=(6, 0, 0), more='node { name: "inner" inline { file: "inner.tsct" } }'))
            wait_until(lambda: place(wall, "/hall/crate") == (6, 0, 0), "both have been looked at")
            self.assertFalse(list(wall.find("/**/inner")), "what was removed stays so")
            wall.undo()
            wait_until(lambda: place(wall, "/hall/inner/hall/crate") == (5, 0, 0), "what it says now")

    def test_a_wall_that_goes_on_from_its_journal_finds_its_files_again(self):
        with Changing(hall(), journal=True) as live:
            with live.connect() as wall:
                number = wall["/hall/crate"].id
                wall["/hall/crane"].translation = (7, 7, 7)
            live.kill_server()
            live.start_server()
            with live.connect() as wall:
                wait_until(lambda: live.said("objects are in the scene; what it changes from now on is taken in") == 1,
                           "it is found")
                self.assertIn("8 of its 8 objects", live.log("server"))
                replace(live.file, hall(crane=(5, 0, 0), crate=(4, 0, 0)))
                wait_until(lambda: place(wall, "/hall/crate") == (4, 0, 0), "the crate moves")
                self.assertEqual(place(wall, "/hall/crane"), (7, 7, 7))
                self.assertEqual(wall["/hall/crate"].id, number)

    def test_what_is_large_comes_in_parts_and_leads_back(self):
        def plant(nodes, x):
            below = "".join(f'node {{ name: "n{i}" transform {{ translation {{ x: {x} y: {i} }} }} }}\n'
                            for i in range(nodes))
            return hall(more=f'node {{ name: "plant" {below} }}')
        with Changing(plant(0, 0)) as live, live.connect() as wall:
            replace(live.file, plant(9000, 1))
            wait_until(lambda: live.said("18000 objects made") == 1, "they come")
            self.assertEqual(len(wall["/hall/plant"].children), 9000)
            replace(live.file, plant(9000, 2))
            wait_until(lambda: live.said("9000 values changed, 0 objects made") == 1, "they move")
            self.assertEqual(place(wall, "/hall/plant/n8999"), (2, 8999, 0))
            replace(live.file, plant(0, 0))
            wait_until(lambda: live.said("18000 removed") == 1, "they go")
            self.assertEqual(len(wall["/hall/plant"].children), 0)
            self.assertEqual(wall.status().undo_depth, 0)

    def test_by_hand_once(self):
        with Changing(hall(), options=()) as live, live.connect() as wall:
            replace(live.file, hall(crate=(3, 0, 0), size=2.0))
            done = live.run("tessera-ctl", "--server", live.address, "--json", "load", "--reload", str(live.file))
            self.assertEqual(done.returncode, 0, done.stderr)
            told = json.loads(done.stdout)
            self.assertEqual(told["reloaded"], {"changed": 2, "created": 0, "removed": 0, "kept": 0}, told)
            self.assertEqual(told["path"], "/hall")
            self.assertEqual(place(wall, "/hall/crate"), (3, 0, 0))
            text = live.run("tessera-ctl", "--server", live.address, "load", "--reload", str(live.file)).stdout
            self.assertIn("0 values changed", text)
            # A viewer of another file: the rules of `load` hold.
            other = live.files / "other.tsct"
            other.write_text(hall())
            refused = live.run("tessera-ctl", "--server", live.address, "load", "--reload", str(other))
            self.assertNotEqual(refused.returncode, 0)
            self.assertIn("--allow", refused.stderr)

    def test_what_an_application_loaded_is_watched(self):
        live = Changing(hall())
        models = live.folder / "models"
        models.mkdir()
        file = models / "box.tsct"
        file.write_text('node { name: "box" transform { translation { x: 1 } } }')
        live._options += ["--allow", str(models)]
        with live, live.connect() as wall:
            box = wall.load(str(file), under="/hall", reload=True)  # it is not there yet
            self.assertEqual(place(wall, "/hall/box"), (1, 0, 0))
            replace(file, 'node { name: "box" transform { translation { x: 2 } } }')
            wait_until(lambda: place(wall, "/hall/box") == (2, 0, 0), "it moves")
            self.assertEqual(wall["/hall/box"].id, box.id)
            wall.remove("/hall/box")
            replace(file, 'node { name: "box" transform { translation { x: 3 } } }')
            again = wall.load(str(file), under="/hall", reload=True)
            self.assertNotEqual(again.id, box.id, "what was removed is loaded anew")
            self.assertEqual(place(wall, "/hall/box"), (3, 0, 0))


if __name__ == "__main__":
    unittest.main()
