"""The console's page in a real browser, before a real wall: a token lets in, and keys alone lead to a field and
back."""
import unittest

import page_browser
import page_wall


@unittest.skipIf(page_browser.WHY_NOT, page_browser.WHY_NOT)
class Page(page_wall.BesideALamp):
    def test_the_token_lets_in_and_does_not_stay_in_the_address(self):
        self.come_in()
        self.assertNotIn("token", self.browser.driver.current_url)
        self.browser.until("its role, beside the test's own link",
                           lambda: self.browser.text("#identity") == "You: operator · 2 here")
        self.browser.until("a state", lambda: "running" in self.browser.text("#wall-state"))
        self.browser.logged()
        # Without it the server asks, and the page still has it
        self.browser.open(self.browser.driver.current_url.partition("#")[0])
        self.browser.until("the wall again", lambda: self.browser.text("#wall-name") == "1x1")
        self.assertTrue(all("401" in line for line in self.browser.logged()))

    def test_keys_alone_lead_to_a_field_and_back_by_undo(self):
        from selenium.webdriver.common.keys import Keys

        self.come_in()
        for _ in range(10):
            self.browser.press(Keys.TAB)
            if self.browser.focused() == "Wall":
                break
        for _ in range(10):
            if self.browser.focused() == "Scene":
                break
            self.browser.press(Keys.ARROW_RIGHT)
        self.row("floor")
        self.browser.press(Keys.TAB)
        self.assertEqual(self.browser.focused(), "Tree")
        self.browser.press(Keys.TAB)
        self.assertEqual(self.browser.focused(), "Search the scene")
        for _ in range(4):
            self.browser.press(Keys.TAB)
            if self.browser.run("return document.activeElement.role") == "treeitem":
                break
        for _ in range(40):
            if "floor" in self.browser.focused():
                break
            self.browser.press(Keys.ARROW_DOWN)
        self.browser.press(Keys.ENTER)
        self.browser.until("the floor's fields", lambda: self.browser.focused() == "floor")
        for _ in range(12):
            self.browser.press(Keys.TAB)
            if self.browser.focused() == "translation, x":
                break
        self.browser.press("a", control=True)
        self.browser.press("3", Keys.ENTER)
        self.browser.until("the floor has moved", lambda: self.wall["/floor"].translation[0] == 3.0)
        self.browser.until("a step to take back", lambda: "(" in self.browser.text(".tools button"))
        self.browser.run("document.querySelector('.object h2').focus()")
        self.browser.press("z", control=True)
        self.browser.until("the floor is back", lambda: self.wall["/floor"].translation[0] == 0.0)
        self.assert_nothing_logged()


if __name__ == "__main__":
    unittest.main()
