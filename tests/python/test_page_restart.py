"""The console's page over a restart of its server with another scene: a number that meant one thing means another
one."""
import unittest

import page_browser
import page_wall


@unittest.skipIf(page_browser.WHY_NOT, page_browser.WHY_NOT)
class PageRestart(page_wall.OnAScene):
    options = {"surface": "none"}

    def restart(self, *names):
        scene = self.live.folder / "other.tsct"
        scene.write_text("".join(f'node {{ name: "{name}" transform {{}} }}\n' for name in names))
        self.live._scene = scene
        self.live.kill_server()
        self.browser.until("a banner", lambda: self.browser.all("#banner"))
        self.live.start_server()
        self.browser.until("no banner", lambda: not self.browser.all("#banner"))
        self.browser.until("the other scene",
                           lambda: self.browser.run(
                               "return [...document.querySelectorAll('[role=treeitem] .name')].map((one) => "
                               "one.textContent)")[1:] == list(names))

    def test_nobody_edits_what_has_the_number_of_something_else(self):
        from selenium.webdriver.common.keys import Keys

        self.come_in()
        self.press(".picture-tools button", "Pick")
        self.browser.run("document.querySelector('.surface').focus()")
        self.browser.press(*[Keys.ARROW_DOWN] * 12, Keys.ENTER)
        self.browser.until("something that stands there", lambda: self.browser.text(".found .path").startswith("/"))
        self.browser.run("document.getElementById('tab-scene').click()")
        self.restart("first", "second")
        self.assertEqual(self.browser.text(".found .path"), "")
        self.assertTrue(self.browser.run("return [...document.querySelectorAll('.found button')].find((one) => "
                                         "one.textContent === 'Show in Scene').hidden"))
        self.select("second")
        self.browser.run("[...document.querySelectorAll('.node-tools button')].find((one) => "
                         "one.textContent.includes('Remove')).click()")
        self.browser.until("a question", lambda: "Remove second?" in self.browser.text("dialog[open]"))
        self.restart("first", "third")
        self.browser.until("no question", lambda: not self.browser.all("dialog[open]"))
        self.assertIn("is gone", self.browser.text(".object h2"))
        self.assertEqual(self.browser.all(".object input, .tree [aria-selected=true]"), [])
        self.select("third")
        self.restart("first", "third")
        self.field("name")
        self.assertEqual(self.browser.text(".object h2"), "third")


if __name__ == "__main__":
    unittest.main()
