"""A browser without a screen for tests of the console's page: Debian's chromium, led by its driver."""
import contextlib
import importlib.util
import os
import pathlib
import re
import shutil
import signal
import time

from eventually import eventually

WHY_NOT = next((f"{what} is not installed (./deploy/set-up installs it)" for what, is_there in (
    ("python3-selenium", importlib.util.find_spec("selenium")), ("chromium", shutil.which("chromium")),
    ("chromium-driver", shutil.which("chromedriver"))) if not is_there), "")
PATIENCE = 30.0  # s
SHOTS = os.environ.get("TESSERA_PAGE_SHOTS")  # a folder for pictures of the page; without it none are made
FILM = os.environ.get("TESSERA_PAGE_FILM")  # a folder for a picture of all that was waited for, one after the other
SIZES = ((360, 740), (1280, 800))

# Of all texts that are shown: those whose contrast with what is behind them is less than 4.5 (WCAG 2.1, 1.4.3).
FAINT = """
const numbers = (colour) => colour.match(/[\\d.]+/g).map(Number);
const light = (colour) => {
  const [r, g, b] = colour.slice(0, 3).map((part) => part / 255).map((part) =>
    part <= 0.03928 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4);
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
};
const behind = (node) => {
  for (; node; node = node.parentElement) {
    const colour = numbers(getComputedStyle(node).backgroundColor);
    if (colour.length < 4 || colour[3] > 0.99) return colour;
  }
  return [255, 255, 255];
};
const faint = [];
for (const node of document.querySelectorAll('body *')) {
  const says = [...node.childNodes].some((child) => child.nodeType === 3 && child.data.trim() !== '');
  if (!says || !node.checkVisibility() || node.closest('.skip')) continue;
  const [a, b] = [light(numbers(getComputedStyle(node).color)), light(behind(node))];
  const contrast = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
  if (contrast < 4.5) faint.push(`${node.textContent.trim().slice(0, 40)}: ${contrast.toFixed(1)}`);
}
return faint;
"""
# What a finger cannot hit: less than 44 pixels wide or high. A tile has a row below the picture that does the same.
SMALL = """
return [...document.querySelectorAll('a, button, input, select, [role=treeitem]')]
  .filter((node) => node.checkVisibility() && !node.matches('.tile, .skip, input[type=range]'))
  .map((node) => [node.getBoundingClientRect(), node])
  .filter(([box]) => box.width < 43.9 || box.height < 43.9)
  .map(([box, node]) => `${node.tagName} ${node.textContent}: ${box.width} x ${box.height}`);
"""


def until(what, condition):
    """Waits for it, and says what it was waiting for."""
    found = eventually(condition, PATIENCE)
    if not found:
        raise AssertionError(f"not within {PATIENCE:.0f} s: {what}")
    return found


def _below(process):
    """Processes that it has started, and those that they have."""
    children = [int(child) for task in pathlib.Path(f"/proc/{process}/task").iterdir()
                for child in (task / "children").read_text().split()]
    return children + [below for child in children for below in _below(child)]


class Browser:
    """`with Browser() as browser:`; what it logs is kept until `logged` is called."""

    def __init__(self, width=1280, height=800, arguments=()):
        """`arguments`: more of chromium's own."""
        from selenium import webdriver
        from selenium.webdriver.chrome.service import Service

        options = webdriver.ChromeOptions()
        options.binary_location = shutil.which("chromium")
        arguments = ["--headless=new", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars",
                     f"--window-size={width},{height}", *arguments]
        if os.geteuid() == 0:
            arguments.append("--no-sandbox")  # there is none for root
        for argument in arguments:
            options.add_argument(argument)
        options.accept_insecure_certs = True  # a wall with keys has an authority of its own
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        self.driver = webdriver.Chrome(options=options, service=Service(shutil.which("chromedriver")))

    def __enter__(self):
        return self

    def __exit__(self, kind, value, trace):
        self.driver.quit()

    def size(self, width, height):
        """As a window, or below 600 pixels as a phone that is touched."""
        self.width = width
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride",
                                    {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600})

    def reduce_motion(self, is_wanted):
        feature = {"name": "prefers-reduced-motion", "value": "reduce" if is_wanted else "no-preference"}
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [feature]})

    @contextlib.contextmanager
    def asleep(self):
        """All of it stands still meanwhile, as on a device that sleeps."""
        processes = _below(self.driver.service.process.pid)
        try:
            for process in processes:
                os.kill(process, signal.SIGSTOP)
            yield
        finally:
            for process in processes:
                os.kill(process, signal.SIGCONT)

    def open(self, url):
        self.driver.get(url)

    def run(self, script, *arguments):
        """What it returns."""
        return self.driver.execute_script(script, *arguments)

    def all(self, selector):
        """Those that are seen, at one moment."""
        return self.run("return [...document.querySelectorAll(arguments[0])].filter((node) => node.checkVisibility() "
                        "&& node.getClientRects().length > 0)", selector)

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
        return self.run("const at = document.activeElement; return at.getAttribute('aria-label') || at.textContent || "
                        "at.id")

    def until(self, what, condition):
        from selenium.common.exceptions import StaleElementReferenceException

        def on_the_page():
            try:
                return condition()
            except StaleElementReferenceException:
                return None  # what was looked at has been replaced meanwhile

        found = until(what, on_the_page)
        if FILM:
            self._save(FILM, f"{time.time_ns() // 1_000_000}-{re.sub('[^A-Za-z0-9]+', '-', what)[:60]}")
        return found

    def _save(self, folder, name):
        pathlib.Path(folder).mkdir(parents=True, exist_ok=True)
        self.driver.save_screenshot(os.path.join(folder, f"{name}.png"))

    def sizes_and_themes(self):
        """Goes through both sizes in both themes; the width and the theme that it is now."""
        for width, height in SIZES:
            self.size(width, height)
            for theme in ("dark", "light"):
                if self.run("return document.documentElement.dataset.theme") != theme:
                    self.run("document.getElementById('theme').click()")
                yield width, theme

    def faults(self):
        """What nobody can read, hit or see as a whole."""
        wide = self.run("return document.documentElement.scrollWidth") - self.width
        return ([f"{wide} pixels are cut off"] if wide > 0 else []) + self.run(FAINT) + self.run(SMALL)

    def shoot(self, name):
        if SHOTS:
            self._save(SHOTS, name)

    def logged(self):
        return [f"{entry['source']}: {entry['message']}" for entry in self.driver.get_log("browser")
                if entry["level"] == "SEVERE" or entry["source"] == "security"]
