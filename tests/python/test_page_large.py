"""The console's page before a scene of very many nodes: its tree, a search, materials behind all of them; no frame
waits for any of it."""
import unittest

import page_browser
import page_wall

MANY = 450_000  # children of one node: more than the wall looks through at once for anybody
AT_ONCE = 50_000


@unittest.skipIf(page_browser.WHY_NOT, page_browser.WHY_NOT)
class PageLarge(page_wall.OnAScene):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        many = cls.wall.create("/many")
        for begin in range(0, MANY, AT_ONCE):
            with cls.wall.edit() as edit:
                for i in range(begin, begin + AT_ONCE):
                    edit.add(many, f"child {i:06}")
        with cls.wall.edit() as edit:
            edit.create("/swing", "Animation", playing=False)
            cls.ball = edit.create("/ball", "Geometry", material=edit.object("Material", baseColor=(1, 0, 0, 1)))

    def look_for(self, text, said):
        self.browser.run("const input = document.querySelector('input[type=search]'); input.value = arguments[0]; "
                         "input.dispatchEvent(new Event('input'))", text)
        self.browser.until(f"{said} of {text}", lambda: self.browser.text(".browse [role=status]") == said)

    def test_what_lies_behind_very_many_is_found_by_itself(self):
        self.come_in(tab="scene")
        with self.wall.follow("frames", timeout=page_browser.PATIENCE) as frames:
            self.browser.run("arguments[0].querySelector('.toggle').click()", self.row("many"))
            self.browser.run("arguments[0].click()", self.row(f"Show more of {MANY - 200:,}"))
            self.row("child 000399")
            self.look_for(f"child {MANY - 1:06}", "1 found")
            self.look_for("/ball", "1 found")
            self.look_for("nobody", "0 found")
            self.look_for("child", "100 found so far")
            self.look_for("", "")
            self.browser.run("document.getElementById('tab-scene-materials').click()")
            self.browser.until("the last material",
                               lambda: f"#{self.ball.material.id}" in self.browser.text(".materials"))
            self.browser.until("all",
                               lambda: self.browser.text("#panel-scene-materials [role=status]") == "4 materials")
            self.browser.run("document.getElementById('tab-scene-animations').click()")
            self.browser.until("the last animation",
                               lambda: self.browser.text("#panel-scene-animations [role=status]") == "1 to 2 of 2")
            end = self.wall.status().frame
            for frame in frames:
                self.assertEqual(frame.held, [])
                if frame.frame >= end:
                    break
        self.assert_nothing_logged()


if __name__ == "__main__":
    unittest.main()
