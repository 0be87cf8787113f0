"""A browser without a screen for tests of the console's page: Debian's chromium, led by its driver."""
import importlib.util
import os
import shutil
import time

WHY_NOT = next((f"{what} is not installed (./deploy/set-up installs it)" for what, is_there in (
    ("python3-selenium", importlib.util.find_spec("selenium")), ("chromium", shutil.which("chromium")),
    ("chromium-driver", shutil.which("chromedriver"))) if not is_there), "")
PATIENCE = 30.0  # s


def until(what, condition):
    """Waits for it, and says what it was waiting for."""
    deadline = time.monotonic() + PATIENCE
    while True:
        found = condition()
        if found:
            return found
        if time.monotonic() > deadline:
            raise AssertionError(f"not within {PATIENCE:.0f} s: {what}")
        time.sleep(0.05)


class Browser:
    """`with Browser() as browser:`; what it logs is kept until `logged` is called."""

    def __init__(self, width=1280, height=800):
        from selenium import webdriver
        from selenium.webdriver.chrome.service import Service

        options = webdriver.ChromeOptions()
        options.binary_location = shutil.which("chromium")
        arguments = ["--headless=new", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars", f"--window-size={width},{height}"]
        if os.geteuid() == 0:
            arguments.append("--no-sandbox")  # there is none for root
        for argument in arguments:
            options.add_argument(argument)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        self.driver = webdriver.Chrome(options=options, service=Service(shutil.which("chromedriver")))

    def __enter__(self):
        return self

    def __exit__(self, kind, value, trace):
        self.driver.quit()

    def size(self, width, height):
        """As a window, or below 600 pixels as a phone that is touched."""
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600})

    def open(self, url):
        self.driver.get(url)

    def run(self, script, *arguments):
        """What it returns."""
        return self.driver.execute_script(script, *arguments)

    def all(self, selector):
        return [one for one in self.driver.find_elements("css selector", selector) if one.is_displayed()]

    def text(self, selector):
        return self.run("return document.querySelector(arguments[0])?.textContent ?? ''", selector)

    def press(self, *keys, control=False):
        """One after the other, wherever the focus is."""
        from selenium.webdriver.common.action_chains import ActionChains
        from selenium.webdriver.common.keys import Keys

        chain = ActionChains(self.driver, duration=0)
        if control:
            chain.key_down(Keys.CONTROL)
        for key in keys:
            chain.send_keys(key)
        if control:
            chain.key_up(Keys.CONTROL)
        chain.perform()

    def focused(self):
        """What it is called: its label or its text."""
        return self.run("const at = document.activeElement; return at.getAttribute('aria-label') || at.textContent || at.id")

    def until(self, what, condition):
        return until(what, condition)

    def logged(self):
        return [f"{entry['source']}: {entry['message']}" for entry in self.driver.get_log("browser") if entry["level"] == "SEVERE" or entry["source"] == "security"]
