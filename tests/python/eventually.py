"""Waits for processes, files and threads that send no event. A test waits for an event where one comes."""
import time

PATIENCE = 60.0  # s; machines are shared
_PAUSE = 0.02  # s


def eventually(holds, patience=PATIENCE):
    """Asks again and again. Returns what `holds()` returned as soon as it is true; after `patience` its last answer."""
    deadline = time.monotonic() + patience
    while not (found := holds()) and time.monotonic() < deadline:
        time.sleep(_PAUSE)  # the one pause of all polls: nothing that they look at sends an event
    return found
