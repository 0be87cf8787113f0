"""Each field of a schema that people write by hand says what it is for."""
import re
import unittest

from live import ROOT

PRINTED = {"application.proto"}  # by tessera-ctl requests --proto; unit_codec looks at its members


def uncommented(text):
    """Fields without a comment on their line, nor on the one above it."""
    lines = text.split("\n")
    for number, line in enumerate(lines):
        code, said, _ = line.partition("//")
        before = lines[number - 1].strip().startswith("//") if number else False
        one_line = re.match(r"\s*(message|enum|oneof) \w+ \{.*\}", code)
        field = re.match(r"\s*(repeated |optional )?[\w.]+ (\w+) = \d+(;| \[)", code)
        told = said or before or one_line
        if field and not told and not re.match(r"\s*(syntax|option|[A-Z_0-9]+ =)", code):
            yield f"{number + 1}: {field[2]}"


class ProtoComments(unittest.TestCase):
    def test_each_field_has_one(self):
        files = sorted(path for path in (ROOT / "proto").glob("*.proto") if path.name not in PRINTED)
        self.assertGreater(len(files), 7)
        for path in files:
            with self.subTest(path.name):
                self.assertEqual(list(uncommented(path.read_text())), [])

    def test_a_field_without_one_is_found(self):
        self.assertEqual(list(uncommented("message A {\n  int32 b = 1;\n  int32 c = 2;  // d\n}")), ["2: b"])


if __name__ == "__main__":
    unittest.main()
