"""`tessera-ctl top`, `watch`, `trace` and `view --by` on a wall of several hosts, one of which is killed and comes
back."""
import contextlib
import fcntl
import json
import os
import pathlib
import pty
import queue
import re
import select
import signal
import struct
import subprocess
import tempfile
import termios
import threading
import time
import unittest

from live import BIN, PATIENCE, Live, run_folder


class Watching(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.enterClassContext(run_folder())
        cls.live = cls.enterClassContext(Live(wall="2x2", size="64x36", surface="none"))
        cls.wall = cls.enterClassContext(cls.live.connect())
        cls.hosts = [host.name for host in cls.wall.status().hosts]

    def ctl(self, *words):
        done = self.live.run("tessera-ctl", "--server", self.live.address, *words)
        self.assertEqual((done.returncode, done.stderr), (0, ""), words)
        return done.stdout

    def started(self, *words, **options):
        process = subprocess.Popen([BIN / "tessera-ctl", "--server", self.live.address, *words], text=True, **options)
        self.addCleanup(process.wait, PATIENCE)
        self.addCleanup(process.kill)
        return process

    def test_top_once_is_plain(self):
        told = json.loads(self.ctl("--json", "top", "--every", "0.5"))
        self.assertEqual([host["name"] for host in told["hosts"]], self.hosts)
        self.assertGreater(told["frames"], 0)
        self.assertGreater(told["frames_a_second"], 1)
        self.assertGreater(told["frame_ms"]["count"], 0)
        for host in told["hosts"]:
            self.assertEqual((host["state"], host["held"]), ("live", 0))
            self.assertGreater(host["shown"], 0)
            self.assertGreaterEqual(host["longest_draw_ms"], host["draw_ms"])
        text = self.ctl("top", "--every", "0.2")
        self.assertNotIn("\x1b", text)
        self.assertRegex(text, r"HOST +STATE +SHOWN +HELD +BEHIND +DRAWS +ROUND TRIP +WAITED FOR\n")
        self.assertEqual(len(re.findall(r"^\S+ +live +\d+ of \d+ ", text, re.M)), len(self.hosts))

    def on_terminal(self, act, rows=20, columns=60):
        """What `top` draws on a terminal of that size until `act(terminal, process)` has ended it."""
        mine, its = pty.openpty()
        fcntl.ioctl(its, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
        before = termios.tcgetattr(its)
        process = self.started("top", "--every", "0.2", stdin=its, stdout=its, stderr=subprocess.PIPE)
        drawn, deadline, acted = b"", time.monotonic() + PATIENCE, False
        while process.poll() is None and time.monotonic() < deadline:
            if select.select([mine], [], [], 0.05)[0]:
                drawn += os.read(mine, 65536)
            if not acted and drawn.count(b"q ends it") >= 2:
                acted = True
                act(mine, process)
        while select.select([mine], [], [], 0)[0]:
            drawn += os.read(mine, 65536)
        self.assertEqual(process.wait(PATIENCE), 0, process.stderr.read())
        self.assertEqual(termios.tcgetattr(its), before, "the terminal is as it was")
        os.close(mine)
        os.close(its)
        return drawn.decode()

    def test_top_on_a_terminal_leaves_it_as_it_was(self):
        for act in (lambda terminal, _: os.write(terminal, b"q"), lambda terminal, _: os.write(terminal, b"\x03"),
                    lambda _, process: process.send_signal(signal.SIGINT),
                    lambda _, process: process.send_signal(signal.SIGTERM)):
            drawn = self.on_terminal(act)
            self.assertTrue(drawn.startswith("\x1b[?1049h\x1b[?25l"), drawn[:40])
            self.assertTrue(drawn.endswith("\x1b[?25h\x1b[?1049l"), drawn[-40:])
            for table in drawn.split("\x1b[H")[1:]:
                lines = table.split("\x1b[J")[0].split("\r\n")
                self.assertLessEqual(len(lines), 20)
                self.assertLessEqual(max(len(line.replace("\x1b[K", "")) for line in lines), 60)
            self.assertIn(self.hosts[0], drawn)

    def test_watch_tells_what_happens(self):
        watch = self.started("--json", "watch", stdout=subprocess.PIPE)
        lines = queue.Queue()
        threading.Thread(target=lambda: [lines.put(json.loads(line)) for line in watch.stdout], daemon=True).start()

        def until(kind, words, patience=PATIENCE):
            while True:
                told = lines.get(timeout=patience)
                if told["kind"] == kind and words in told["text"]:
                    return told

        def next_frames():
            for _ in zip(range(3), self.wall.follow("frames", timeout=PATIENCE)):
                pass

        # Nothing tells when it has begun to listen: guests come until it tells of one.
        came, end = None, time.monotonic() + PATIENCE
        while came is None and time.monotonic() < end:
            with self.live.connect(name="a guest"):
                next_frames()
            with contextlib.suppress(queue.Empty):
                came = until("person", "came", patience=0.1)
        self.assertEqual((came["what"], came["program"], came["role"]), ("came", "a guest", "operator"))
        until("person", "went")
        self.wall["/row"].translation = (1, 2, 3)
        edited = until("edit", "row")
        self.assertFalse(edited["taken_back"])
        self.ctl("undo")
        self.assertTrue(until("edit", "taken back")["taken_back"])
        name = self.hosts[1]
        self.live.hosts[name].kill()
        lost = until("host", f"{name} is lost")
        self.assertEqual((lost["host"], lost["was"]), (name, "live"))
        self.live.start_host(name)
        until("host", f"{name} is live")
        watch.send_signal(signal.SIGINT)
        self.assertEqual(watch.wait(PATIENCE), 0, "Ctrl-C is no error")

    def test_watch_ends_where_nobody_reads(self):
        process = self.started("watch", stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        process.stdout.close()  # as `watch | head -1`, on a wall on which nothing happens
        process.wait(PATIENCE)

    def test_trace_takes_the_place_of_files_alone(self):
        pipe = self.live.folder / "pipe"
        os.mkfifo(pipe)
        done = self.live.run("tessera-ctl", "--server", self.live.address, "trace", str(pipe), "--frames", "1")
        self.assertEqual(done.returncode, 1, done.stdout)
        self.assertIn("device, pipe or socket", done.stderr)
        self.assertTrue(pipe.is_fifo())

    def test_trace_is_a_file_of_trace_events(self):
        file = self.live.folder / "trace.json"
        self.assertIn(f"30 frames of {len(self.hosts)} hosts", self.ctl("trace", str(file), "--frames", "30"))
        events = json.loads(file.read_text())["traceEvents"]
        names = {event["pid"]: event["args"]["name"] for event in events if event["ph"] == "M"}
        self.assertEqual(sorted(names.values())[:-1], sorted(f"host {host}" for host in self.hosts))
        for process, name in names.items():
            slices = [event for event in events if event["ph"] == "X" and event["pid"] == process
                      and "frame" in event["args"]]
            self.assertEqual(len(slices), 30, name)
            frames = [event["args"]["frame"] for event in slices]
            self.assertEqual(frames, list(range(frames[0], frames[0] + 30)), "every one, in order")
            for before, after in zip(slices, slices[1:]):
                self.assertGreater(before["dur"], 0)
                self.assertLessEqual(before["ts"] + before["dur"], after["ts"], "frames do not overlap")
            if name.startswith("wall "):
                continue
            for part in ("works", "apply"):
                inner = [event for event in events if event["ph"] == "X" and event["pid"] == process
                         and event["name"] == part]
                self.assertGreater(len(inner), 20, part)
                for event in inner:
                    self.assertTrue(any(frame["ts"] - 1 <= event["ts"] and
                                        event["ts"] + event["dur"] <= frame["ts"] + frame["dur"] + 1
                                        for frame in slices), "within its frame")
            seen = [event["args"]["seen_ms_before_its_end"] for event in slices if "last_seen" in event["args"]]
            self.assertGreater(len(seen), 20, "what the host's clock says, on the server's")
        no_folder = str(self.live.folder / "server.log" / "trace.json")
        refused = self.live.run("tessera-ctl", "--server", self.live.address, "trace", no_folder, "--frames", "1")
        self.assertEqual((refused.returncode, refused.stdout), (3, ""))
        self.assertIn(no_folder, refused.stderr)

    def test_draw_times_are_those_of_hosts_that_draw(self):
        folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        (folder / "turns.tsct").write_text("""
            node { name: "thing" transform { } box { size { x: 1 y: 1 z: 1 } } }
            node { name: "turns" motion { target: "thing" mode: LOOP key { time: 0 transform { } }
                   key { time: 1 transform { translation { x: 1 } } } } }""")
        with Live(scene=folder / "turns.tsct", surface="osmesa", size="64x36") as live:
            told = json.loads(live.run("tessera-ctl", "--json", "--server", live.address, "top", "--every", "1").stdout)
            self.assertGreater(told["hosts"][0]["draw_ms"], 0)
            file = live.folder / "trace.json"
            self.assertEqual(live.run("tessera-ctl", "--server", live.address, "trace", str(file),
                                      "--frames", "10").returncode, 0)
            events = json.loads(file.read_text())["traceEvents"]
            self.assertGreater(len([event for event in events if event["name"] == "draw" and event["dur"] > 0]), 5)

    def test_view_by_is_from_where_the_wall_stands(self):
        self.ctl("view", "--position", "1", "2", "3", "--orientation", "1", "0", "0", "0", "--scale", "2")
        told = json.loads(self.ctl("--json", "view", "--by", "--position", "0", ".5", "-1", "--scale", "3",
                                   "--orientation", "0", "0", "1", "0"))
        self.assertEqual(told["position"], [1, 2.5, 2])
        plan = self.wall.ask("GetWall")
        self.assertEqual(tuple(plan.position), (1, 2.5, 2))
        self.assertEqual(plan.world_units_per_metre, 6)
        self.assertAlmostEqual(abs(tuple(plan.orientation)[2]), 1)
        self.ctl("view", "--by", "--orientation", "0", "0", "1", "0")
        plan = self.wall.ask("GetWall")
        self.assertAlmostEqual(abs(tuple(plan.orientation)[0]), 1)
        self.assertEqual(tuple(plan.position), (1, 2.5, 2))


if __name__ == "__main__":
    unittest.main()
