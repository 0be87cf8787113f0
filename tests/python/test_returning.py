"""An array that came back, in another handle, outlives the one that was there before: hosts join, and files are
saved."""
import pathlib
import unittest

from eventually import eventually
from live import PATIENCE, Live, run_folder


class Returning(unittest.TestCase):
    def later(self, wall, frames):
        end = wall.status().frame + frames
        with wall.frames(timeout=PATIENCE) as told:
            while next(told).frame < end:
                pass

    def test_a_text_that_came_back_is_found_by_name_once_the_history_forgets_the_first_one(self):
        with run_folder() as folder, Live(surface="none", options=["--rate", "0"]) as live, live.connect() as wall:
            with wall.edit() as edit:
                sign, other = (edit.create(path, "Text", text="first") for path in ("/sign", "/other"))
                moved = edit.create("/moved")
            for text in ("Wall", "i", "Wall"):
                sign.core.text = text
            for step in range(300):
                moved.name = f"moved {step}"
            self.later(wall, 700)
            for text in ("one", "two"):  # what was named in frames of long ago goes when another array comes
                other.core.text = text
                self.later(wall, 10)
            host, process = next(iter(live.hosts.items()))
            process.kill()
            process.wait()
            live.start_host(host)
            self.assertTrue(eventually(lambda: "is back" in live.log("server")), live.log(host))
            saved = live.run("tessera-ctl", "--server", live.address, "save", str(pathlib.Path(folder) / "saved.tsct"))
            self.assertEqual(saved.returncode, 0, saved.stderr)


if __name__ == "__main__":
    unittest.main()
