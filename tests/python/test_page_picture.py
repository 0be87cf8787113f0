"""The console's page on the picture of real walls: picks, drags, measures and flights, by mouse, keys and fingers."""
import math
import pathlib
import tempfile
import unittest

import page_browser
import page_wall
from live import YARD

STAND = {"position": (0.0, -0.2, 4.0), "orientation": (1.0, 0.0, 0.0, 0.0), "world_units_per_metre": 1.5}


# ---- rays by hand: nothing of the page's own geometry is used

def plus(a, b):
    return [x + y for x, y in zip(a, b)]


def minus(a, b):
    return [x - y for x, y in zip(a, b)]


def times(a, factor):
    return [x * factor for x in a]


def turned(a, rotation):
    """By the matrix of a rotation (w, x, y, z) of length 1."""
    w, x, y, z = rotation
    rows = ((1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
            (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
            (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)))
    return [sum(m * v for m, v in zip(row, a)) for row in rows]


def ray_through(corners, eye, u, v, stand):
    """World: from the eye (in the wall's frame) through the part u from the left, v from above, of a screen."""
    lower_left, lower_right, upper_left = corners
    on_screen = plus(upper_left,
                     plus(times(minus(lower_right, lower_left), u), times(minus(lower_left, upper_left), v)))

    def world(place):
        return plus(stand["position"], times(turned(place, stand["orientation"]), stand["world_units_per_metre"]))
    return world(eye), minus(world(on_screen), world(eye))


def at_height(ray, y):
    origin, direction = ray
    return plus(origin, times(direction, (y - origin[1]) / direction[1]))


FRONT = ((-1.6, 0.6, 0), (1.6, 0.6, 0), (-1.6, 2.4, 0))  # deploy/walls/1x1.wall
VIEWER = (0, 1.7, 2.4)


def stand_ray(u, v):
    """Of the wall where it stands."""
    return ray_through(FRONT, VIEWER, u, v, STAND)


def on_depth(ray, z):
    origin, direction = ray
    return plus(origin, times(direction, (z - origin[2]) / direction[2]))


def seen_at(point):
    """Where a point of the world is seen from there: parts of the picture."""
    eye = plus(STAND["position"], times(VIEWER, 1.5))
    assert point[2] < eye[2]
    inside = times(minus(point, STAND["position"]), 1 / 1.5)
    t = VIEWER[2] / (VIEWER[2] - inside[2])
    x, y = (e + t * (p - e) for e, p in zip(VIEWER[:2], inside[:2]))
    return (x + 1.6) / 3.2, (2.4 - y) / 1.8


class OnAPicture(page_wall.OnAPage):
    """With a hand on the mouse."""
    options = {"surface": "none", "size": "960x540"}

    def choose(self, tool):
        button = self.browser.until(f"a tool {tool}",
                                    lambda: next(
                                        (b for b in self.browser.all(".picture-tools button") if b.text == tool), None))
        button.click()
        self.browser.until("its surface", lambda: self.browser.all(".surface"))

    def surface_at(self, u, v, tile=0):
        """A place of a tile's picture in the window, whole pixels; and which part of the tile that is."""
        self.browser.run("document.querySelectorAll('.tile')[arguments[0]].scrollIntoView({ block: 'center' })", tile)
        left, top, width, height = self.browser.run(
            "const box = document.querySelectorAll('.tile')[arguments[0]].getBoundingClientRect(); return [box.left, "
            "box.top, box.width, box.height]", tile)
        x, y = round(left + u * width), round(top + v * height)
        return x, y, (x - left) / width, (y - top) / height

    def chain(self):
        """Of a hand on the mouse, at places of the window."""
        from selenium.webdriver.common.action_chains import ActionChains

        return ActionChains(self.browser.driver, duration=0)

    def mouse(self, kind, u, v, tile=0):
        """A hand that holds the button over several calls: the driver's own moves let go of what was held for a
        while."""
        x, y, *part = self.surface_at(u, v, tile)
        held = 0 if kind == "mouseReleased" else 1
        self.browser.driver.execute_cdp_cmd("Input.dispatchMouseEvent",
                                            {"type": kind, "x": x, "y": y, "button": "left", "buttons": held,
                                             "clickCount": 1})
        return part

    def press(self, u, v, tile=0):
        """Presses there; the ray that leads through the very place."""
        x, y, u, v = self.surface_at(u, v, tile)
        chain = self.chain()
        chain.w3c_actions.pointer_action.move_to_location(x, y)
        chain.click().perform()
        return u, v

    def said(self):
        return self.browser.text(".tool-side")

    @classmethod
    def show_yard(cls, more=""):
        """With a box that has a handle, and what is said."""
        yard = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory())) / "yard.tsct"
        yard.write_text(YARD.read_text() + more +
                        'node { name: "box" transform { translation { x: -4.2 y: 1 z: 0 } } box { size { x: 0.5 y: '
                        '0.5 z: 0.5 } } }\n'
                        'node { name: "gizmo" transform { translation { x: -4.2 y: 1 z: 0 } } manipulator { target: '
                        '"box" } }\n')
        cls.options = {"surface": "none", "size": "960x540", "scene": yard}


@unittest.skipIf(page_browser.WHY_NOT, page_browser.WHY_NOT)
class Picture(OnAPicture):
    @classmethod
    def setUpClass(cls):
        cls.show_yard(
            'node { name: "turned" transform { translation { x: -3.5 y: 2.2 z: -1 } rotation { axis { z: 1 } '
            'angle_deg: 90 } scale { x: 2 y: 2 z: 2 } }\n'
            '  node { name: "inner" transform { translation { x: 0.1 } } box { size { x: 0.4 y: 0.4 z: 0.4 } } } }\n')
        super().setUpClass()

    def setUp(self):
        super().setUp()
        self.wall["/drive"].playing = False
        self.wall["/carriage"].translation = (-2, 0.5, 0)
        self.wall["/box"].translation = (-4.2, 1, 0)
        self.wall.ask("SetView", **STAND)

    def place_of(self, point):
        return seen_at(point)

    def ray(self, u, v):
        return stand_ray(u, v)

    def test_a_pick_finds_what_the_wall_finds_there(self):
        self.come_in()
        self.choose("Pick")
        found = set()
        for u in (0.15, 0.33, 0.5, 0.61, 0.72, 0.85):
            for v in (0.1, 0.55, 0.75, 0.95):
                u_at, v_at = self.press(u, v)
                told = self.wall.ask("PickAt", x_px=int(u_at * 960), y_px=int(v_at * 540))
                wanted = f"#{told.node} ·" if told.hit else "Nothing stands there."
                self.browser.until(f"what is at {u}, {v}: {wanted}", lambda: wanted in self.said())
                found.add(told.node if told.hit else 0)
        self.assertGreater(len(found), 3, "sky, floor, balls, and what stands on it")
        self.assert_nothing_logged()

    def test_what_was_picked_opens_in_the_scene(self):
        self.come_in()
        self.choose("Pick")
        self.press(*self.place_of((-2, 0.5, 0.5)))
        self.browser.until("the carriage", lambda: "/carriage/body" in self.said())
        next(b for b in self.browser.all(".tool-side button") if b.text == "Show in Scene").click()
        self.browser.until("its fields", lambda: self.browser.text(".object h2") == "body")
        self.assertEqual(self.browser.run("return location.hash"), "#scene")

    def test_keys_alone_pick_and_drag(self):
        from selenium.webdriver.common.keys import Keys

        self.come_in()
        self.choose("Pick")
        for _ in range(12):
            self.browser.press(Keys.TAB)
            if self.browser.focused().startswith("Pick on the picture"):
                break
        self.browser.press(Keys.ARROW_UP, Keys.ENTER)
        told = self.wall.ask("PickAt", x_px=480, y_px=270 - 0.02 * 540)
        self.browser.until("what is there", lambda: (f"#{told.node} ·" if told.hit else "Nothing") in self.said())
        self.choose("Drag")
        self.browser.run("document.querySelector('.surface').focus()")
        u, v = self.place_of((-2, 0.5, 0.5))
        step = 0.02 * 540  # pixels of the wall that a key leads by
        self.browser.press(*[Keys.ARROW_LEFT] * round((0.5 - u) * 960 / step),
                           *[Keys.ARROW_DOWN] * round((v - 0.5) * 540 / step + 1))
        self.browser.press(Keys.ENTER)
        self.browser.until("it is held", lambda: "/carriage" in self.said())
        self.browser.press(*[Keys.ARROW_UP] * 3, Keys.ENTER)
        distance = 7.6 - 0.5  # from the eye to its front, of which 3.6 are before the screen, in the world's units
        way = 3 * 0.02 * 1.8 * 1.5 * distance / 3.6
        self.browser.until("it has risen",
                           lambda: math.dist(self.wall["/carriage"].translation, (-2, 0.5 + way, 0)) < 1e-9)

    def drag(self, *places):
        """Presses at the first, goes to the others, lets go; the parts of the picture that these were."""
        chain, parts = self.chain(), []
        for i, (u, v) in enumerate(places):
            x, y, *part = self.surface_at(u, v)
            parts.append(part)
            chain.w3c_actions.pointer_action.move_to_location(x, y)
            if i == 0:
                chain.click_and_hold()
        chain.release().perform()
        return parts

    def test_a_drag_leads_a_thing_along_its_plane_and_is_one_step(self):
        self.come_in()
        self.choose("Drag")
        depth, begin = self.wall.status().undo_depth, self.wall["/carriage"].translation
        from_, to = self.place_of((-2, 0.5, 0.5)), self.place_of((-1.3, 0.9, 0.5))
        steps = [plus(from_, times(minus(to, from_), i / 8)) for i in range(9)]
        parts = self.drag(*steps)
        self.browser.until("it was moved", lambda: "/carriage: " in self.said())

        front = 0.5  # it is one unit deep
        wanted = plus(begin, minus(on_depth(self.ray(*parts[-1]), front), on_depth(self.ray(*parts[0]), front)))
        self.browser.until("it is where the hand is",
                           lambda: math.dist(self.wall["/carriage"].translation, wanted) < 1e-9)
        self.assertEqual(self.wall.status().undo_depth, depth + 1)
        next(b for b in self.browser.all(".tool-side button") if "Undo" in b.text).click()
        self.browser.until("all of it is back", lambda: self.wall["/carriage"].translation == begin)
        self.assertEqual(self.wall.status().undo_depth, depth)
        self.assert_nothing_logged()

    def test_what_lies_in_a_turned_and_scaled_node_follows_the_hand(self):
        self.come_in()
        self.choose("Drag")
        # A tenth along the node's x, which is the world's y, twice as long
        begin = self.wall["/turned/inner"].translation
        from_, to = self.place_of((-3.5, 2.4, -0.6)), self.place_of((-3.1, 2.6, -0.6))
        first, last = self.drag(from_, to)

        x, y, z = minus(on_depth(self.ray(*last), -0.6), on_depth(self.ray(*first), -0.6))
        wanted = plus(begin, (y / 2, -x / 2, z / 2))
        self.browser.until("it is where the hand is",
                           lambda: math.dist(self.wall["/turned/inner"].translation, wanted) < 1e-9)

    def test_what_stands_in_the_way_stops_it_and_is_named(self):
        self.come_in()
        self.choose("Drag")
        from_, to = self.place_of((-2, 0.5, 0.5)), self.place_of((4, 0.5, 0.5))
        self.drag(from_, to)
        self.browser.until("who stopped it", lambda: "Stopped by /post" in self.said())
        x = self.wall["/carriage"].translation[0]
        self.assertGreater(x, 1)
        self.assertLess(x, 1.85 - 0.5 + 1e-6, "half of it before the post's face")
        self.wall["/stop"].set(response="ask", patience=600)
        self.wall["/carriage"].translation = (-2, 0.5, 0)
        self.drag(from_, to)
        self.browser.until("who stopped it", lambda: "Stopped by /post" in self.said())
        self.wall.respond(self.wall.questions()[0], "stop")
        self.wall["/stop"].set(response="stop")
        self.assert_nothing_logged()

    def test_what_nothing_can_move_says_so(self):
        self.come_in()
        self.choose("Drag")
        self.press(0.5, 0.05)
        self.browser.until("the sky", lambda: "Nothing stands there" in self.said())

    def test_two_who_drag_one_thing(self):
        self.come_in()
        self.choose("Drag")
        u, v = self.place_of((-2, 0.5, 0.5))
        self.mouse("mousePressed", u, v)
        self.browser.until("it is held", lambda: "/carriage" in self.said())
        self.wall["/carriage"].translation = (-2.5, 0.8, 0)  # somebody else
        self.mouse("mouseMoved", u + 0.04, v)
        self.mouse("mouseReleased", u + 0.04, v)
        self.browser.until("the last one has it",
                           lambda: self.wall["/carriage"].translation[1] == 0.5
                           and self.wall["/carriage"].translation[0] > -2)
        # A handle is one person's at a time.
        handle = self.wall.ask("GrabHandle", ray=self.handle_ray())
        self.assertTrue(handle.hit)
        u, v = self.place_of(handle.point)
        self.press(u, v)
        self.browser.until("why not", lambda: "✕" in self.said())
        self.wall.ask("ReleaseHandle")
        self.press(u, v)
        self.browser.until("now it is ours", lambda: "Handle of /gizmo" in self.said())

    def handle_ray(self):
        eye = plus(STAND["position"], times(VIEWER, 1.5))
        for dx in range(-10, 11):
            for dy in range(-10, 11):
                ray = {"origin": eye, "direction": minus((-4.2 + dx * 0.08, 1 + dy * 0.08, 0), eye)}
                if self.wall.ask("GrabHandle", ray=ray).hit:
                    return ray
        self.fail("no handle of the gizmo")

    def test_a_handle_is_led_and_is_one_step(self):
        box = self.wall["/box"]
        begin, depth = box.translation, self.wall.status().undo_depth
        handle = self.wall.ask("GrabHandle", ray=self.handle_ray())
        self.wall.ask("ReleaseHandle")
        self.come_in()
        self.choose("Drag")
        u, v = self.place_of(handle.point)
        self.drag((u, v), (u + 0.01, v - 0.02), (u + 0.02, v - 0.05))
        self.browser.until("it has moved", lambda: box.translation != begin)
        self.assertIn("Handle of /gizmo", self.said())
        self.browser.until("it is let go", lambda: not self.wall[f"#{handle.node}"].core.held)
        self.assertEqual(self.wall.status().undo_depth, depth + 1)
        self.wall.undo()
        self.assertEqual(box.translation, begin)

    def test_measures_are_true_to_a_millionth(self):
        self.come_in()
        self.choose("Measure")
        a = at_height(self.ray(*self.press(0.3, 0.9)), 0)
        self.browser.until("the first", lambda: "From /floor" in self.said())
        b = at_height(self.ray(*self.press(0.6, 0.97)), 0)
        self.browser.until("the distance", lambda: "From /floor" in self.said() and "to /floor" in self.said())
        units, metres = self.measured()
        self.assertAlmostEqual(units / math.dist(a, b), 1, delta=1e-6)
        self.assertAlmostEqual(metres / (math.dist(a, b) / 1.5), 1, delta=1e-6)
        # From a place on the floor to the nearest place of the post, a box of known size.
        self.browser.run("const to = document.querySelector('.tool-side select'); to.value = 'surface'")
        a = at_height(self.ray(*self.press(0.3, 0.9)), 0)
        self.browser.until("the second is wanted", lambda: "Now the second" in self.said())
        self.press(*self.place_of((2, 0.75, 1)))
        self.browser.until("the distance to it", lambda: "to /post" in self.said())
        nearest = [min(max(value, least), most) for value, least, most in zip(a, (1.85, 0, -1), (2.15, 1.5, 1))]
        self.assertAlmostEqual(self.measured()[0] / math.dist(a, nearest), 1, delta=1e-6)
        self.assert_nothing_logged()

    def measured(self):
        units, _, rest = self.browser.text(".measured").partition(" units · ")
        return float(units), float(rest.partition(" m in the room")[0])

    def stand(self):
        return list(self.wall.ask("GetWall").position)

    def still(self):
        """Where the wall is once it is the same over some frames."""
        def looks():
            before, frame = self.stand(), self.wall.status().frame
            self.browser.until("frames", lambda: self.wall.status().frame > frame + 5)
            return before if self.stand() == before else None
        return self.browser.until("the wall stands still", looks)

    def test_keys_fly_and_stop_at_key_up_and_at_blur(self):
        self.come_in()
        self.choose("Fly")
        self.browser.run("document.querySelector('.surface').focus()")
        begin = self.still()
        chain = self.chain().key_down("w")
        chain.perform()
        self.browser.until("it flies", lambda: self.stand()[2] < begin[2] - 0.2)
        self.chain().key_up("w").perform()
        there = self.still()
        self.assertLess(there[2], begin[2])
        for leave in ("document.getElementById('theme').focus()", "dispatchEvent(new Event('blur'))"):
            self.browser.run("document.querySelector('.surface').focus()")
            before = self.still()
            self.chain().key_down("s").perform()
            self.browser.until("it flies back", lambda: self.stand()[2] > before[2] + 0.2)
            self.browser.run(leave)
            self.still()
            self.chain().key_up("s").perform()
        self.assert_nothing_logged()

    def test_mouse_buttons_and_bookmarks(self):
        self.come_in()
        self.choose("Fly")
        begin = self.wall.ask("GetWall")
        x, y, *_ = self.surface_at(0.5, 0.5)
        chain = self.chain()
        chain.w3c_actions.pointer_action.move_to_location(x, y)
        chain.click_and_hold()
        chain.w3c_actions.pointer_action.move_to_location(x - 100, y)
        chain.release().perform()
        height = self.browser.run("return document.querySelector('.surface').clientHeight")

        def turned_by():
            w, _, up, _ = self.wall.ask("GetWall").orientation
            return 2 * math.atan2(up, w)
        # A drag over the height turns by 60 degrees, the way that the hand goes.
        self.browser.until("it has turned", lambda: abs(turned_by() - 100 / height * math.pi / 3) < 1e-4)
        self.click("Keep")
        self.browser.until("kept", lambda: "Kept as bookmark 1" in self.said())
        forward = next(b for b in self.browser.all(".ways button") if b.get_attribute("aria-label") == "Forward")
        before = self.stand()
        self.chain().click_and_hold(forward).perform()
        self.browser.until("it goes", lambda: math.dist(self.stand(), before) > 0.2)
        self.chain().release().perform()
        there = self.still()
        self.click("Go")
        self.browser.until("it is back", lambda: math.dist(self.stand(), before) < 1e-9)
        self.assertGreater(math.dist(there, before), 0.2)
        self.click("Home")
        self.browser.until("home", lambda: math.dist(self.stand(), begin.position) < 1e-9)
        self.browser.run("document.querySelector('.surface').focus()")
        self.browser.press("9")
        self.browser.until("why not", lambda: "nobody has kept a bookmark 9" in self.said())
        self.browser.run("const mode = document.querySelector('[aria-label=\"How to move\"]'); mode.value = 'orbit'; "
                         "mode.dispatchEvent(new Event('change'))")
        self.browser.until("it orbits", lambda: self.wall.status().navigation == "orbit")
        self.wall.ask("NavigateView", mode="fly")

    def touch(self, kind, *places):
        """Fingers, at places of the window."""
        points = [{"x": x, "y": y, "id": i} for i, (x, y) in enumerate(places)]
        self.browser.driver.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    def test_fingers_look_shift_and_go_and_a_touch_that_is_taken_away_ends(self):
        self.browser.size(360, 740)
        self.come_in()
        self.choose("Fly")
        begin = self.wall.ask("GetWall")
        x, y, *_ = self.surface_at(0.5, 0.5)
        self.touch("touchStart", (x, y))
        self.touch("touchMove", (x + 40, y))
        self.touch("touchEnd")
        self.browser.until("it has turned", lambda: self.wall.ask("GetWall").orientation != begin.orientation)
        self.still()
        self.wall.ask("SetView", **STAND)
        before = self.stand()
        self.touch("touchStart", (x - 60, y), (x + 60, y))
        self.touch("touchMove", (x - 60, y - 30), (x + 60, y - 30))
        self.browser.until("it is shifted down", lambda: self.stand()[1] < before[1] - 0.1)
        self.assertAlmostEqual(self.stand()[2], before[2], delta=1e-6)
        self.touch("touchMove", (x - 130, y - 30), (x + 130, y - 30))
        self.browser.until("it goes forward", lambda: self.stand()[2] < before[2] - 0.3)
        self.touch("touchCancel")
        self.still()
        self.assert_nothing_logged()

    def test_a_wall_that_is_lost_in_the_middle_holds_no_key(self):
        self.come_in()
        self.choose("Fly")
        self.browser.run("document.querySelector('.surface').focus()")
        begin = self.still()
        self.chain().key_down("w").perform()
        self.browser.until("it flies", lambda: self.stand()[2] < begin[2] - 0.2)
        self.live.kill_server()
        self.browser.until("a banner", lambda: self.browser.all("#banner"))
        self.live.start_server()
        self.browser.until("no banner", lambda: not self.browser.all("#banner"))
        self.still()
        self.chain().key_up("w").perform()
        self.browser.until("a surface", lambda: self.browser.all(".surface"))
        self.browser.run("document.querySelector('.surface').focus()")
        before = self.still()
        self.chain().key_down("s").perform()
        self.browser.until("it flies again", lambda: self.stand()[2] > before[2] + 0.2)
        self.chain().key_up("s").perform()
        self.still()

    def test_marks_stay_on_what_they_mark(self):
        self.come_in()
        self.choose("Pick")
        self.press(*self.place_of((-2, 0.5, 0.5)))
        self.browser.until("the carriage", lambda: "/carriage/body" in self.said())
        self.wall.ask("SetView", position=(-1.0, -0.2, 4.0))
        u, v = self.place_of((-1, 0.5, 0.5))  # as the wall has gone by one, it is seen one farther to the right

        def near():
            d = self.browser.run("return document.querySelector('.mark-dot')?.getAttribute('d') ?? ''")
            numbers = d.split()
            return len(numbers) > 2 and math.hypot(float(numbers[1]) / 3.2 - u, float(numbers[2]) / 1.8 - v) < 0.01
        self.browser.until("the mark has moved", near)

    def test_what_is_picked_or_below_the_mouse_is_fitted_and_turned_around(self):
        def in_the_room(point):
            told = self.wall.ask("GetWall")
            w, x, y, z = told.orientation
            return times(turned(minus(point, told.position), (w, -x, -y, -z)), 1 / told.world_units_per_metre)
        middle = (0, 1.5, 0)  # of the screen
        self.come_in()
        self.choose("Pick")
        self.press(*self.place_of((-2, 0.5, 0.5)))
        self.browser.until("the carriage", lambda: "/carriage/body" in self.said())
        self.choose("Fly")
        self.click("Fit what was picked")
        self.browser.until("it is in the middle", lambda: math.dist(in_the_room((-2, 0.5, 0)), middle) < 1e-6)
        self.wall.ask("SetView", **STAND)
        x, y, *_ = self.surface_at(*self.place_of((2, 0.75, 1)))
        chain = self.chain()
        chain.w3c_actions.pointer_action.move_to_location(x, y)
        chain.perform()
        self.browser.run("document.querySelector('.surface').focus()")
        self.browser.press("f")
        self.browser.until("the post is in the middle", lambda: math.dist(in_the_room((2, 0.75, 0)), middle) < 1e-6)
        # An orbit goes around what was pressed: that stays as far away.
        self.wall.ask("SetView", **STAND)
        self.wall.ask("NavigateView", mode="orbit")
        pressed = (2, 0.75, 1)
        before = math.dist(in_the_room(pressed), VIEWER)
        self.drag(self.place_of(pressed), plus(self.place_of(pressed), (0.1, 0.05)))
        self.browser.until("it has turned", lambda: abs(self.wall.ask("GetWall").orientation[2]) > 0.1)
        self.still()
        self.assertAlmostEqual(math.dist(in_the_room(pressed), VIEWER), before, delta=0.01)
        self.wall.ask("NavigateView", mode="fly")
        self.assert_nothing_logged()

    def tap(self, u, v):
        x, y, *_ = self.surface_at(u, v)
        self.touch("touchStart", (x, y))
        self.touch("touchEnd")

    def test_a_finger_looks_picks_and_measures(self):
        self.browser.driver.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": True})
        self.addCleanup(self.browser.driver.execute_cdp_cmd, "Emulation.setTouchEmulationEnabled", {"enabled": False})
        self.browser.size(360, 740)
        self.come_in()
        self.browser.until("its picture", lambda: self.browser.all(".tile"))
        self.tap(0.5, 0.5)
        self.browser.until("its numbers", lambda: "Round trip" in self.browser.text("dialog[open]"))
        self.browser.run("document.querySelector('dialog[open]').close()")
        body = self.place_of((-2, 0.5, 0.5))
        self.choose("Pick")
        self.tap(*body)
        self.browser.until("the carriage", lambda: "/carriage/body" in self.said())
        self.choose("Measure")
        self.tap(*body)
        self.browser.until("the second is wanted", lambda: "Now the second" in self.said())
        self.tap(0.3, 0.9)
        self.browser.until("the distance", lambda: "to /floor" in self.said())
        self.assertLessEqual(self.browser.run("return document.scrollingElement.scrollWidth"), 360)
        self.assert_nothing_logged()

    def test_a_finger_drags_a_thing(self):
        self.browser.size(360, 740)
        self.come_in()
        self.choose("Drag")
        x, y, *_ = self.surface_at(*self.place_of((-2, 0.5, 0.5)))
        self.touch("touchStart", (x, y))
        self.browser.until("it is held", lambda: "/carriage" in self.said())
        self.touch("touchMove", (x, y - 30))
        self.touch("touchEnd")
        self.browser.until("it has risen", lambda: self.wall["/carriage"].translation[1] > 0.9)

    def click(self, text):
        next(b for b in self.browser.all(".tool-side button") if b.text == text).click()

    def test_who_leaves_in_the_middle_holds_nothing(self):
        self.come_in()
        self.choose("Fly")
        self.browser.run("document.querySelector('.surface').focus()")
        begin = self.still()
        self.chain().key_down("w").perform()
        self.browser.until("it flies", lambda: self.stand()[2] < begin[2] - 0.2)
        self.browser.open("about:blank")
        self.still()
        self.chain().key_up("w").perform()

    def test_who_only_looks_has_no_tool_that_changes_anything(self):
        self.come_in("viewer")
        names = self.browser.until("tools", lambda: [b.text for b in self.browser.all(".picture-tools button")])
        self.assertEqual(names, ["Look", "Pick", "Measure"])
        self.choose("Pick")
        self.press(*self.place_of((-2, 0.5, 0.5)))
        self.browser.until("the carriage", lambda: "/carriage/body" in self.said())
        self.assert_nothing_logged()

    def test_nothing_is_cut_off_faint_or_too_small_for_a_finger(self):
        self.come_in()
        for width, theme in self.browser.sizes_and_themes():
            for tool in ("Pick", "Measure", "Drag", "Fly"):
                self.choose(tool)
                if tool in ("Pick", "Measure"):
                    self.press(*self.place_of((-2, 0.5, 0.5)))
                    self.browser.until("what is there", lambda: "/carriage/body" in self.said())
                with self.subTest(width=width, theme=theme, tool=tool):
                    self.assertEqual(self.browser.faults(), [])
                self.browser.shoot(f"{tool}-{width}-{theme}")
        self.assert_nothing_logged()


@unittest.skipIf(page_browser.WHY_NOT, page_browser.WHY_NOT)
class Room(OnAPicture):
    """A CAVE in stereo, whose left eye is shown."""
    wall_name, options = "cave4-stereo", {"surface": "none"}

    def test_picks_on_all_screens_are_those_of_rays_by_hand(self):
        half = math.sqrt(0.5)
        stand = {"position": (0.5, -0.2, 3.0), "orientation": (half, 0.0, half, 0.0), "world_units_per_metre": 1.5}
        self.wall.ask("SetView", **stand)
        head = (0.1, 1.6, 1.2)
        self.wall.ask("SetView", user="viewer", head=head)
        eye = plus(head, (-0.0325, 0, 0))
        corners = {"front": ((-1.2, 0, 0), (1.2, 0, 0), (-1.2, 2.4, 0)),
                   "left": ((-1.2, 0, 2.4), (-1.2, 0, 0), (-1.2, 2.4, 2.4)),
                   "right": ((1.2, 0, 0), (1.2, 0, 2.4), (1.2, 2.4, 0)),
                   "floor": ((-1.2, 0, 2.4), (1.2, 0, 2.4), (-1.2, 0, 0))}
        self.come_in()
        self.choose("Pick")
        tiles = [tile.get_attribute("aria-label")
                 for tile in self.browser.driver.find_elements("css selector", ".tile")]
        hits = 0
        for screen, places in corners.items():
            tile = next(i for i, name in enumerate(tiles) if f"Tile {screen}-0-0-left" in name)
            for u, v in ((0.3, 0.6), (0.7, 0.8)):
                origin, direction = ray_through(places, eye, *self.press(u, v, tile), stand)
                told = self.wall.ask("PickAt", ray={"origin": origin, "direction": direction})
                self.browser.until(f"what is on {screen} at {u}, {v}: {told}", lambda: self.shows(told))
                hits += told.hit
        self.assertGreater(hits, 3)
        self.assert_nothing_logged()

    def shows(self, told):
        """The same node, and the same place to a hundredth of a millimetre."""
        node, _, place = self.said().partition(" from the eye · at ")
        if not told.hit or not place:
            return not told.hit and "Nothing stands there." in node
        return (f"#{told.node} ·" in node
                and math.dist(map(float, place.partition("Show")[0].split(", ")), told.point) < 1e-5)


if __name__ == "__main__":
    unittest.main()
