"""The console's tab Files in a real browser: files dropped and chosen, loaded once somebody has said so, stopped,
refused; what goes out."""
import json
import pathlib
import tempfile
import unittest

import page_browser
import page_wall
import test_loads
import test_uploads
from live import ROOT, Live, run_folder

STRANGE = "<img src=x onerror=alert(1)>"

# Files that a page has in memory, as if they were dropped on it.
DROP = """
const data = new DataTransfer();
for (const [name, bytes] of arguments[0]) data.items.add(new File([new Uint8Array(bytes)], name));
for (const type of ['dragover', 'drop']) document.body.dispatchEvent(new DragEvent(type, { bubbles: true,
  cancelable: true, dataTransfer: data }));
"""
BUTTON = """
const [within, text] = arguments;
return [...document.querySelectorAll(`${within} button`)].find((one) => one.checkVisibility() &&
  one.textContent.includes(text));
"""


@unittest.skipIf(page_browser.WHY_NOT, page_browser.WHY_NOT)
class PageFiles(page_wall.OnAPage):
    @classmethod
    def setUpClass(cls):
        cls.enterClassContext(run_folder())
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory(prefix="tessera-files-")))
        (cls.folder / "models/inner").mkdir(parents=True)
        for i in range(3):
            (cls.folder / f"models/letter-{i}.txt").write_text("no model")
        (cls.folder / "models/inner/crane.tsct").write_bytes((ROOT / "tests/data/outside/crane.tsct").read_bytes())
        (cls.folder / "models" / STRANGE).write_text("no model")
        (cls.folder / "large").mkdir()
        test_loads.write_grid(cls.folder / "large/grid.obj", 500)
        cls.live = cls.enterClassContext(Live(surface="osmesa", size="64x48",
                                              options=["--allow", str(cls.folder / "models"), str(cls.folder / "large"),
                                                       "--uploads-mib", "1"]))
        cls.browser = cls.enterClassContext(page_browser.Browser())
        cls.wall = cls.enterClassContext(cls.live.connect())
        cls.browser.driver.execute_cdp_cmd("Browser.setDownloadBehavior",
                                           {"behavior": "allow", "downloadPath": str(cls.folder)})

    def come_in(self, role="operator", tab="wall"):
        super().come_in(role, tab)
        self.browser.until("what this role has",
                           lambda: "Picture of the whole wall" in self.browser.text("#panel-files"))

    def button(self, text, within=""):
        return self.browser.until(f"a button {text}", lambda: self.browser.run(BUTTON, within, text))

    def said(self, text):
        self.browser.until(f"“{text}” on the page", lambda: text in self.browser.text("#panel-files"))

    def drop(self, **files):
        self.browser.run(DROP, [(name, list(body if isinstance(body, bytes) else body.encode()))
                                for name, body in files.items()])

    def nodes(self):
        return {node.path for node in self.wall.find("/*")}

    def test_a_model_that_is_dropped_anywhere_is_loaded_once_somebody_has_said_so(self):
        self.come_in()  # the tab Wall
        before = self.nodes()
        self.drop(**{"gate.gltf": test_uploads.model("gate.bin"), "gate.bin": test_uploads.TRIANGLE})
        self.browser.until("a question",
                           lambda: "Load gate.gltf into the scene?" in self.browser.text("dialog[open] h2"))
        self.assertEqual(self.nodes(), before)
        field = self.browser.all("dialog[open] .number")[0]
        field.send_keys("2")
        self.button("Load", "dialog[open]").click()
        self.said("✓ gate.gltf: ")
        self.browser.shoot("loaded")
        self.assertTrue(any("gate" in path for path in self.nodes() - before))
        self.assert_nothing_logged()

    def test_a_question_that_another_one_replaces_leaves_that_one_its_answer(self):
        self.come_in(tab="files")
        for name in ("first", "second"):
            self.drop(**{f"{name}.gltf": test_uploads.model("gate.bin"), "gate.bin": test_uploads.TRIANGLE})
            self.browser.until("a question",
                               lambda name=name: f"Load {name}.gltf" in self.browser.text("dialog[open] h2"))
        self.button("Load", "dialog[open]").click()
        self.said("✓ second.gltf: ")
        self.assertFalse(any("first" in path for path in self.nodes()))
        self.assert_nothing_logged()

    def test_keys_alone_choose_and_not_now_loads_nothing(self):
        from selenium.webdriver.common.keys import Keys

        self.come_in(tab="files")
        self.browser.until("a button", lambda: self.browser.all(".drop button"))
        for _ in range(12):
            self.browser.press(Keys.TAB)
            if self.browser.focused() == "Choose files":
                break
        self.assertEqual(self.browser.focused(), "Choose files")
        before = self.nodes()
        crane = self.folder / "models/inner/crane.tsct"
        self.browser.driver.find_element("css selector", "input[type=file]").send_keys(str(crane))
        self.browser.until("a question",
                           lambda: "Load crane.tsct into the scene?" in self.browser.text("dialog[open] h2"))
        self.browser.press(Keys.ESCAPE)
        self.browser.until("no question", lambda: not self.browser.all("dialog[open]"))
        self.assertEqual(self.nodes(), before)
        self.assert_nothing_logged()

    def test_what_is_no_model_and_what_is_too_large_is_said_in_words(self):
        self.come_in(tab="files")
        self.drop(**{"letter.txt": "dear wall"})
        self.said("nothing in it is a model")
        self.drop(**{"false.glb": "dear wall"})
        self.button("Load", "dialog[open]").click()
        self.said("✕ false.glb")
        self.drop(**{"large.glb": bytes(1_100_000)})
        self.said("there is room for")
        self.browser.shoot("refused")
        self.assertNotIn("large.glb", json.dumps([entry["name"] for entry in self.listed()]))
        self.assertTrue(all("/api" in line or "400" in line for line in self.browser.logged()))

    def listed(self):
        door = test_uploads.Door(self.live)
        return door.request("GetFiles", folder=door.used()["folder"])[1]["fields"]["entries"]

    def test_one_that_is_stopped_is_not_there(self):
        self.come_in(tab="files")
        self.browser.driver.execute_cdp_cmd("Network.enable", {})
        slow = {"offline": False, "latency": 1, "downloadThroughput": -1, "uploadThroughput": 20_000}
        self.browser.driver.execute_cdp_cmd("Network.emulateNetworkConditions", slow)
        self.drop(**{"stopped.gltf": "x" * 800_000})
        self.said(" of 781 KiB")  # the row stands as it is from now on
        self.button("Stop", ".transfers").click()
        self.said("✕ Stopped.")
        self.browser.driver.execute_cdp_cmd("Network.emulateNetworkConditions", {**slow, "uploadThroughput": -1})
        self.assertNotIn("stopped.gltf", [entry["name"] for entry in self.listed()])
        self.button("Close", ".transfers").click()
        self.assertFalse(self.browser.all(".transfers li"))

    def test_folders_are_looked_through_and_their_files_loaded(self):
        self.come_in(tab="files")
        self.button("models", ".folder").click()
        self.said("letter-2.txt")
        self.said(STRANGE)
        self.browser.shoot("folder")
        self.assertEqual(self.browser.run("return document.querySelectorAll('main img').length"), 0)
        self.button("inner", ".folder").click()
        self.button("crane.tsct", ".folder").click()
        self.button("Load", "dialog[open]").click()
        self.said("✓ crane.tsct: ")
        self.button("↑", ".folder").click()
        self.said("letter-0.txt")
        self.button("↑", ".folder").click()
        self.browser.until("all folders", lambda: self.browser.text(".folder h3") == "Folders")
        self.assert_nothing_logged()

    def test_a_load_says_how_far_it_is_and_is_cancelled(self):
        self.come_in(tab="files")
        before = self.nodes()
        self.button("large", ".folder").click()
        self.button("grid.obj", ".folder").click()
        self.button("Load", "dialog[open]").click()
        importer = test_loads.Importer(self.folder / "large/grid.obj")
        self.browser.until("how far it is", lambda: "grid.obj: " in self.browser.text(".outcome"))
        self.assertRegex(self.browser.text(".outcome"), "reading|converting")
        self.browser.shoot("loading")
        self.button("Cancel", ".outcome").click()
        self.said("cancelled by")
        self.assertFalse(self.browser.all(".outcome button"))
        self.browser.until("the importer to be gone", lambda: not importer.is_there())
        self.assertEqual(self.nodes(), before)

    def test_what_was_brought_is_removed_once_somebody_has_said_so(self):
        self.come_in(tab="files")
        self.drop(**{"away.txt": "dear wall"})
        self.said("nothing in it is a model")
        self.button("Brought by people", ".folder").click()
        remove = self.browser.until("a button", lambda: self.browser.all("[aria-label='Remove away.txt']"))
        remove[0].click()
        self.button("Remove", "dialog[open]").click()
        self.browser.until("it to be gone", lambda: "away.txt" not in [entry["name"] for entry in self.listed()])
        self.browser.until("its row to be gone", lambda: not self.browser.all("[aria-label='Remove away.txt']"))
        self.assert_nothing_logged()

    def test_the_scene_and_the_wall_come_out(self):
        self.come_in(tab="files")
        for title, name, begin in (("Picture", "wall.png", b"\x89PNG"), ("as text", "scene.tsct", b""),
                                   ("as it is", "scene.tsc", b"")):
            self.button(title, ".take").click()
            file = self.folder / name
            self.browser.until(name, lambda file=file: file.exists() and file.stat().st_size > 0)
            self.assertTrue(file.read_bytes().startswith(begin))
        self.assert_nothing_logged()

    def test_who_only_looks_sees_the_picture_alone(self):
        self.come_in("viewer", "files")
        self.button("Picture of the whole wall")
        self.assertEqual(len(self.browser.all("#panel-files button")), 1)
        self.drop(**{"gate.gltf": "x"})
        self.assertFalse(self.browser.all(".transfers li"))
        self.assert_nothing_logged()

    def test_nothing_is_cut_off_faint_or_too_small_for_a_finger(self):
        self.come_in(tab="files")
        for width, theme in self.browser.sizes_and_themes():
            for state in ("files", "load"):
                if state == "load":
                    self.drop(**{"a-model-with-a-long-name-that-no-narrow-page-has-room-for-in-one-line.glb": "x"})
                    self.browser.until("a question", lambda: self.browser.all("dialog[open]"))
                with self.subTest(width=width, theme=theme, state=state):
                    self.assertEqual(self.browser.faults(), [])
                self.browser.shoot(f"{state}-{width}-{theme}")
            self.button("Not now", "dialog[open]").click()
        self.assert_nothing_logged()


if __name__ == "__main__":
    unittest.main()
