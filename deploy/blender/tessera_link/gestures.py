"""Which changes are one gesture: what changes in a row by one drag is one step of the wall's undo."""
import time

_PAUSE = 1.0  # s without a change end it


class Gestures:
    def __init__(self):
        self.token = 0  # changes with each operator that Blender finishes
        self._name = self._of = self._token = None
        self._at, self._count = 0.0, 0

    def name_for(self, of):
        """Of changes of these subjects, which are sent now; empty: there are none."""
        now = time.perf_counter()
        if not of:
            if self._token != self.token:
                self._name = None  # the operator is done
            return ""
        if self._name is None or of != self._of or now - self._at > _PAUSE:
            self._count += 1
            self._name, self._of, self._token = f"blender {self._count}", of, self.token
        said, self._at = self._name, now
        if self._token != self.token:
            self._name = None  # this was its last
        return said

    def end(self):
        self._name = None
