#!/usr/bin/python3
"""What it costs a wall to be looked at from a page: `console.py [--json FILE] [--seconds S] [--rows
look,crowd,tablets,sockets,faults,input,upload,reload]`.

A server and four hosts that draw 960×540 together, on this machine; the view moves in each frame. Rows:
  rest   nobody looks: frames, and what server and hosts take of a core
  look   one socket asks for the wall's pictures again and again, as a page does: pictures a second, the first one after
  the socket has
         opened, and the same figures as in rest
  crowd  chromium shows the page, and nine sockets look, five of which stop reading: frames that came later than 50 ms
  after the one
         before, with and without them
  tablets  a hundred tablets show a panel, ten of which hold a slider: late frames as in crowd, how long they wait for
  what they ask sockets  a thousand sockets ask for a tree of 100,000 nodes without a pause: late frames as in crowd,
  how many were let in; the same
         beside a process that burns its core
  faults a host is killed, one is stopped, both come back: from the server's own word in its log until a socket that has
  subscribed to
         states hears of it, and until the page in chromium shows it (limit 250 ms)
  upload 1 GiB is brought as a file while the wall draws: how fast, what the server's memory grows by, late frames as in
  crowd reload a file of 100,000 nodes that share a mesh is replaced whenever it has been taken in, 500 nodes of it
  changed, while a person moves
         another one in each frame; hosts draw nothing: late frames as in crowd, and from the rename until a socket
         hears of the change
  input  a node is moved at one socket while another one is told of changes: from saying it to hearing of it, while the
  wall draws as
         fast as it can, beside the time that two frames take; the same from a field of the page in chromium ("page")
Browsers, tablets, sockets and what is brought give way (nice 19): they would run on other machines.
No verdict on time here: tests/bench/README.md says why."""
import argparse
import concurrent.futures
import http.client
import json
import math
import multiprocessing
import os
import pathlib
import re
import resource
import select
import signal
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.get("TESSERA_BUILD", ROOT / "build"))
sys.path[:0] = [str(BUILD / "python"), str(ROOT / "tests/python")]

import console_reload  # noqa: E402
import page_browser  # noqa: E402
from console_socket import WebSocket  # noqa: E402
from door import burn, hammer, watch  # noqa: E402
from live import Live, figure, run_folder  # noqa: E402

import tessera  # noqa: E402

LATE_S = 0.050
CONTEXT = multiprocessing.get_context("spawn")


def door_of(live):
    return live.link().split("//")[1].split("/?token=")


class Looker:
    def __init__(self, door, token):
        self.socket = WebSocket(door, token)
        self.stamp = self.asked = 0

    def ask(self, request, **fields):
        self.asked += 1
        self.socket.ask(self.asked, request, **fields)

    def look(self):
        """Pictures and their bytes."""
        self.ask("GetPreview", shrink=1, after=self.stamp)
        said = self.socket.read()
        self.stamp = said["fields"]["stamp"]
        pictures = [self.socket.read() for _ in range(said.get("binaries", 0))]
        return len(pictures), sum(map(len, pictures))


def told(pipe, work, *arguments):
    """A process of its own: in one, a thread gets the interpreter up to 5 ms late, and would take its own lateness for
    the wall's."""
    process = CONTEXT.Process(target=work, args=(*arguments, pipe), daemon=True)
    process.start()
    return process


class Beside:
    """`with Beside(work, …) as it:` works meanwhile; `it.result` afterwards."""

    def __init__(self, work, *arguments):
        self._mine, theirs = CONTEXT.Pipe()
        self._process = told(theirs, work, *arguments)
        self._mine.recv()

    def __enter__(self):
        return self

    def __exit__(self, kind, value, trace):
        self._mine.send("enough")
        self.result = self._mine.recv()
        self._process.join(20)


def move(address, pipe):
    """The whole wall, in each frame."""
    with tessera.connect(address) as wall:
        pipe.send("ready")
        turn = 0
        while not pipe.poll():
            turn += 1
            wall.ask("SetView", position=(0.3 * math.sin(turn / 30), 2, 6))
            time.sleep(1 / 60)
    pipe.send(None)


def look(door, token, pipe):
    opened = time.perf_counter()
    looker = Looker(door, token)
    first = sum_of = count = answers = 0
    begin = time.perf_counter()
    pipe.send("ready")
    while not pipe.poll():
        pictures, size = looker.look()
        first = first or time.perf_counter() - opened
        answers, count, sum_of = answers + 1, count + pictures, sum_of + size
    lasted = time.perf_counter() - begin
    looker.socket.close()
    pipe.send({"pictures_per_s": round(answers / lasted, 1), "tiles_per_s": round(count / lasted, 1),
               "kB_per_s": round(sum_of / lasted / 1e3), "first_ms": round(first * 1e3, 1)})


def stop_reading(door, token, pipe):
    lookers = [Looker(door, token) for _ in range(5)]
    for looker in lookers:
        for _ in range(200):
            looker.ask("GetPreview", shrink=1, after=0)
    pipe.send("ready")
    while not pipe.poll():
        time.sleep(0.05)
    pipe.send(None)


def taken(process):
    """Of a core, in seconds."""
    fields = pathlib.Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def over(values, part):
    return sorted(values)[min(len(values) - 1, int(part * len(values)))]


def frames(live, seconds, look=lambda: None):
    """Gaps between frames, and what each process took; `look` is called again and again meanwhile."""
    before = list(map(taken, live._processes))
    begin = time.perf_counter()
    with Beside(watch, live.address) as clock:
        while time.perf_counter() < begin + seconds:
            look()
            time.sleep(0.05)
    lasted = time.perf_counter() - begin
    shares = [(now - was) / lasted for was, now in zip(before, map(taken, live._processes))]
    gaps = [after - at for at, after in zip(clock.result, clock.result[1:])]
    return {"frames": len(gaps), "p50_ms": round(over(gaps, 0.5) * 1e3, 2), "p99_ms": round(over(gaps, 0.99) * 1e3, 2),
            "late": sum(gap > LATE_S for gap in gaps), "longest_ms": round(max(gaps) * 1e3, 1),
            "server_share": round(shares[0], 3), "host_share": round(max(shares[1:]), 3)}


def rows_of_look(live, seconds):
    door, token = door_of(live)
    with Beside(move, live.address):
        rest = frames(live, seconds)
        with Beside(look, door, token) as page:
            seen = frames(live, seconds)
    return [{"row": "rest", **rest}, {"row": "look", **seen, **page.result}]


# How often a tile of the page is drawn anew.
COUNT_DRAWN = """
window.drawn = 0;
const draw = CanvasRenderingContext2D.prototype.drawImage;
CanvasRenderingContext2D.prototype.drawImage = function (...given) { window.drawn += 1; return draw.apply(this, given);
  };
"""


def browse(link, pipe):
    """The page in chromium, as it opens."""
    os.nice(19)
    with page_browser.Browser() as browser:
        browser.open(link)
        browser.until("the page", lambda: "running" in browser.text("#wall-state"))
        browser.run(COUNT_DRAWN)
        begin = time.perf_counter()
        pipe.send("ready")
        pipe.recv()
        pipe.send({"tiles_per_s": round(browser.run("return window.drawn") / (time.perf_counter() - begin), 1)})


def rows_of_crowd(live, seconds):
    door, token = door_of(live)
    with Beside(move, live.address):
        without = frames(live, seconds)
        pages = [Beside(look, door, token) for _ in range(4)]
        with Beside(browse, live.link()) as chromium, Beside(stop_reading, door, token):
            beside = frames(live, seconds)
        for page in pages:
            page.__exit__(None, None, None)
    return [{"row": "crowd", "without": without, "with": beside, "chromium": chromium.result,
             "pages": [page.result["pictures_per_s"] for page in pages]}]


PANEL = """
controls { label: "Sun" node: "/sun/light" field: "intensity" slider { greatest: 5 } }
controls { label: "Carriage" node: "/carriage" field: "translation" choice { options { label: "Near"
  value: "0 1 1" } } }
"""


def hold(door, token, at, until):
    """A tablet, as `panel-link.js` has it: looks once a second; the first ten hold a slider meanwhile. Seconds waited
    for each answer."""
    connection = http.client.HTTPConnection(door, timeout=60)
    waited, stamp, value = [], "", None

    def ask(request, **fields):
        begin = time.perf_counter()
        connection.request("POST", f"/api/{request}", json.dumps(fields), {"Authorization": f"Bearer {token}"})
        answer = connection.getresponse()
        said = json.loads(answer.read())
        if answer.status != 200:
            raise RuntimeError(f"{request}: {said}")
        waited.append(time.perf_counter() - begin)
        return said["fields"]

    next_look = time.perf_counter() + at / 100
    while time.perf_counter() < until:
        if time.perf_counter() >= next_look:
            told = ask("GetPanel", since=stamp)
            stamp, next_look = told["stamp"], next_look + 1
            value = told["controls"][0]["now"] if "controls" in told else value
        if at < 10 and value:
            ask("ProposeChanges", list={"set": [{"type": value["type"], "field": value["field"],
                                                 "ids": [value["object"]],
                                                 "values": [1 + time.perf_counter() % 3]}]})
        time.sleep(0.1 if at < 10 else max(0, next_look - time.perf_counter()))
    connection.close()
    return waited


def tablets(link, seconds, pipe):
    os.nice(19)
    door, token = link.split("//")[1].split("/?token=")
    until = time.perf_counter() + seconds
    with concurrent.futures.ThreadPoolExecutor(100) as threads:
        held = [threads.submit(hold, door, token, at, until) for at in range(100)]
        pipe.send("ready")
        waited = [took for one in held for took in one.result()]
    pipe.recv()
    pipe.send({"asked_per_s": round(len(waited) / seconds), "answer_p50_ms": round(1e3 * over(waited, 0.5), 1),
               "answer_p99_ms": round(1e3 * over(waited, 0.99), 1)})


def rows_of_tablets(live, seconds):
    link = re.search(r"panel \S+: (\S+)", live.log("server")).group(1)
    with Beside(move, live.address):
        without = frames(live, seconds)
        with Beside(tablets, link, seconds) as held:
            beside = frames(live, seconds)
    return [{"row": "tablets", "without": without, "with": beside, **held.result}]


def storm(door, token, pipe):
    os.nice(19)
    resource.setrlimit(resource.RLIMIT_NOFILE, (4096, 4096))
    hammer(door, token, 1000,
           b"".join(WebSocket.question(at, "GetTree", node="/many", page_size=1000) for at in range(200)), pipe)


def rows_of_sockets(live, seconds):
    door, token = door_of(live)
    with live.connect() as wall:
        with wall.edit() as edit:
            edit.create("/many")
        for part in range(10):
            with wall.edit() as edit:
                for at in range(10_000):
                    edit.create(f"/many/{part}-{at}")
    with Beside(move, live.address):
        without = frames(live, seconds)
        with Beside(burn):
            burned = frames(live, seconds)
        with Beside(storm, door, token) as stormed:
            beside = frames(live, seconds)
    read, closed, refused = stormed.result
    return [{"row": "sockets", "without": without, "burned": burned, "with": beside, "read_MiB": read >> 20,
             "closed": closed, "refused": refused}]


def hear(door, token, pipe):
    """When which hosts were told to be in which state, and when the scene was told to be another."""
    ear = WebSocket(door, token, path="/socket?changes=1")
    ear.ask(1, "SubscribeNews", states=True)
    states, changes = [], []
    pipe.send("ready")
    while not pipe.poll():
        if not select.select([ear.socket], [], [], 0.05)[0]:
            continue
        said = ear.read()
        if isinstance(said, bytes):
            continue
        if said.get("notice") == "States":
            states.append((time.time(), {host["name"]: host["state"] for host in said["fields"]["hosts"]}))
        elif "changes" in said and not said["changes"].get("whole"):
            changes.append(time.time())
    pipe.send((states, changes))


def follow(path, pipe):
    """Lines that come to a log, and when."""
    lines = []
    with open(path, encoding="utf-8") as log:
        log.seek(0, os.SEEK_END)
        pipe.send("ready")
        while not pipe.poll():
            line = log.readline()
            if line:
                lines.append((time.time(), line))
            else:
                time.sleep(0.001)
    pipe.send(lines)


# When each line of the list of faults came, in seconds since 1970.
WATCH_FAULTS = """
window.faults = [];
new MutationObserver((changes) => changes.forEach((change) => change.addedNodes.forEach((node) =>
  window.faults.push([(performance.timeOrigin + performance.now()) / 1000,
    node.textContent])))).observe(document.querySelector('.faults'), {childList: true});
"""


def rows_of_faults(live, times=8):
    door, token = door_of(live)
    rows, hosts = [], [process.args[process.args.index("--host") + 1] for process in live._processes[1:]]
    with page_browser.Browser() as browser:
        browser.open(f"{live.link()}#time")
        browser.until("the page", lambda: "running" in browser.text("#wall-state"))
        browser.run(WATCH_FAULTS)
        with Beside(hear, door, token) as ear, Beside(follow, live.folder / "server.log") as log:
            for turn in range(times):
                name = hosts[turn % len(hosts)]
                process = next(one for one in live._processes if name in one.args and one.poll() is None)
                if turn % 2:
                    process.send_signal(signal.SIGSTOP)
                    time.sleep(3)
                    process.send_signal(signal.SIGCONT)
                else:
                    process.kill()
                    process.wait()
                    time.sleep(1)
                    live.start_host(name)
                browser.until("all is well", lambda: "running" in browser.text("#wall-state"))
                time.sleep(1)
        seen = browser.run("return window.faults")
    said = [(at, line) for at, line in log.result if "noticed" in line]
    for at, line in said:
        name = next(host for host in hosts if f" {host}: " in line)
        told = min((when - at for when, states in ear.result[0] if when > at - 1 and states[name] != "live"), key=abs)
        shown = min((when - at for when, text in seen if when > at - 1 and f"Host {name}: live, now" in text), key=abs)
        rows.append((told, shown))
    return [{"row": "faults", "count": len(rows), "limit_ms": 250, "socket_ms": [round(1e3 * told) for told, _ in rows],
             "page_ms": [round(1e3 * shown) for _, shown in rows]}]


def bring(door, token, pipe):
    """1 GiB; from another machine it would take none of this one's cores."""
    os.nice(19)
    connection = http.client.HTTPConnection(door, timeout=600)
    pipe.send("ready")
    begin = time.perf_counter()
    connection.request("PUT", "/upload/large", (bytes(1 << 20) for _ in range(1024)),
                       {"Authorization": f"Bearer {token}", "Content-Length": str(1 << 30)})
    status = connection.getresponse().status
    lasted = time.perf_counter() - begin
    connection.close()
    pipe.recv()
    pipe.send({"status": status, "MB_per_s": round((1 << 30) / lasted / 1e6)})


def rows_of_upload(live, seconds):
    door, token = door_of(live)
    with Beside(move, live.address):
        without = frames(live, seconds)
        before = figure(live.server, "VmRSS")
        with Beside(bring, door, token) as brought:
            highest = []
            meanwhile = frames(live, seconds, lambda: highest.append(figure(live.server, "VmRSS")))
    return [{"row": "upload", "without": without, "with": meanwhile,
             "memory_MiB": round((max(highest) - before) / 1024, 1), **brought.result}]


# A number is typed into the field of a light; the moment, in seconds since 1970.
TYPE = """
const field = document.querySelector(".object [aria-label='intensity']");
field.value = arguments[0];
const now = performance.timeOrigin + performance.now();
field.dispatchEvent(new Event('change', {bubbles: true}));
return now / 1000;
"""


def seconds_of_page_input(live, times):
    """From a change of a field in chromium until a socket hears of it."""
    with live.connect() as wall, wall.edit() as edit:
        edit.create("/lamp", "PointLight", intensity=2.0, range=5.0)
    with page_browser.Browser() as browser, Beside(hear, *door_of(live)) as ear:
        browser.size(1280, 800)
        browser.open(f"{live.link()}#scene")
        browser.until("the tree", lambda: browser.all("[role=treeitem]"))
        next(row for row in browser.all("[role=treeitem]") if "lamp" in row.text).click()
        browser.until("the field", lambda: browser.all(".object [aria-label='intensity']"))
        typed = []
        for turn in range(times):
            typed.append(browser.run(TYPE, 1 + 0.01 * turn))
            time.sleep(0.03)
        time.sleep(0.5)
    heard = ear.result[1]
    return [next(when for when in heard if when >= at) - at for at in typed]


def rows_of_input(live, times=300):
    door, token = door_of(live)
    hand = WebSocket(door, token)
    eye = WebSocket(door, token, path="/socket?changes=1")
    took = []
    for turn in range(times):
        said = time.perf_counter()
        hand.ask(turn, "MoveNode", node="/carriage", translation=[0.001 * turn, 1, 1])
        while "changes" not in (heard := eye.read()) or heard["changes"].get("whole"):
            pass
        took.append(time.perf_counter() - said)
        hand.read()
    pace = frames(live, 3)
    page = seconds_of_page_input(live, times)
    return [{"row": "input", "page_p50_ms": round(over(page, 0.5) * 1e3, 2),
             "page_p99_ms": round(over(page, 0.99) * 1e3, 2), "p50_ms": round(over(took, 0.5) * 1e3, 2),
             "p99_ms": round(over(took, 0.99) * 1e3, 2),
             "longest_ms": round(max(took) * 1e3, 1), "two_frames_and_50_ms": round(2 * pace["p50_ms"] + 50, 1)}]


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--json")
    options.add_argument("--seconds", type=float, default=20)
    options.add_argument("--rows", default="look,crowd,tablets,sockets,faults,input,upload,reload")
    said = options.parse_args()
    rows = []
    with run_folder() as folder:
        for name in said.rows.split(","):
            if name == "reload":
                rows += console_reload.rows(said.seconds)
                continue
            given = [] if name == "input" else ["--rate", "60"]
            if name == "tablets":
                (folder / "hall.panel").write_text(PANEL)
                given += ["--panel", str(folder / "hall.panel")]
            with Live(wall="2x2", surface="osmesa", size="960x540", options=given) as live:
                if name == "look":
                    rows += rows_of_look(live, said.seconds)
                elif name == "crowd":
                    rows += rows_of_crowd(live, said.seconds)
                elif name == "tablets":
                    rows += rows_of_tablets(live, said.seconds)
                elif name == "sockets":
                    rows += rows_of_sockets(live, said.seconds)
                elif name == "faults":
                    rows += rows_of_faults(live)
                elif name == "input":
                    rows += rows_of_input(live)
                elif name == "upload":
                    rows += rows_of_upload(live, said.seconds)
                else:
                    options.error(f"no row {name}")
    print(*map(json.dumps, rows), sep="\n")
    if said.json:
        pathlib.Path(said.json).write_text(json.dumps({"rows": rows, "load": os.getloadavg(), "cores": os.cpu_count()},
                                                      indent=1) + "\n")


if __name__ == "__main__":
    main()
