"""When both sides are compared: at rest. Whoever moves something meanwhile goes first, though not for ever."""
import itertools
import time

_AFTER = 0.5  # s of rest
_PATIENCE = 60.0  # s
_LOOKED_AT = 16  # objects in one pump


class Rest:
    """A comparison of many objects takes seconds, in which nothing is sent: one that is disturbed is given up, and made
    at the next rest."""

    def __init__(self):
        self._at = self._wanted_at = None
        self.looking = False  # the courier is
        self.patient = False  # what was found may be given up again
        self._touched = {}  # objects of which Blender told meanwhile

    def soon(self):
        """Each call puts it off."""
        now = time.monotonic()
        self._wanted_at = now if self._wanted_at is None else self._wanted_at
        self._at = min(now + _AFTER, self._wanted_at + _PATIENCE)

    def put_off(self):
        """Something moves."""
        if self._at is not None:
            self.soon()

    def begin_at_once(self):
        """Not to be given up."""
        self._at, self._wanted_at, self.looking, self.patient = None, 0.0, True, False

    @property
    def is_awaited(self):
        return self._at is not None or self.looking

    @property
    def is_due(self):
        return self._at is not None and time.monotonic() > self._at

    def begin(self):
        """Whether it may be given up."""
        patient = time.monotonic() < self._wanted_at + _PATIENCE
        self._at, self.looking = None, True
        return patient

    def disturbed(self):
        self.looking = self.patient = False
        self.soon()

    def found(self, patient):
        self.looking, self.patient = False, patient
        self._touched.clear()
        if self._at is None and not patient:
            self._wanted_at = None

    def done(self):
        self.patient = False
        if self._at is None:
            self._wanted_at = None

    def touch(self, subject):
        if self.patient:
            self._touched[subject] = None

    def is_moved(self, link):
        """Something was here; what is put here as it stands at the wall is no news."""
        some = list(itertools.islice(self._touched, _LOOKED_AT))
        for subject in some:
            del self._touched[subject]
        return any(link.objects.get(each.key) is each and each.node.exists and each.has_moved(link) for each in some)
