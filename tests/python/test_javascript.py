"""A client in plain JavaScript that has nothing but proto/WIRE.md and what tessera-ctl prints: it reads the recorded
session and asks a wall."""
import json
import random
import shutil
import subprocess
import tempfile
import unittest

import record
from live import BUILD, PATIENCE, ROOT, Live
from tessera import _hash

FOLDER = ROOT / "tests/python/javascript"


@unittest.skipUnless(shutil.which("node"), "node is not installed (apt-get install nodejs)")
class JavaScript(unittest.TestCase):
    def node(self, *arguments):
        done = subprocess.run(["node", *map(str, arguments)], capture_output=True, text=True, timeout=PATIENCE,
                              cwd=FOLDER)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        return done.stdout

    def test_the_page_is_enough_for_a_client(self):
        with tempfile.NamedTemporaryFile("w", suffix=".tsct") as scene:
            scene.write(record.SCENE)
            scene.flush()
            with Live(scene=scene.name, surface="none") as live, live.connect() as wall:
                said = self.node("check.mjs", BUILD / "python/tessera/requests.json", record.FILE, live.address,
                                 live.token())
                self.assertRegex(said, r"read \d+ messages\nmoved #\d+ of 1x1; frame \d+ was shown by all\n")
                self.assertEqual(wall["/thing"].translation, (4.0, 5.0, 6.0))

    def test_a_link_of_a_console_is_enough_for_a_client(self):
        with tempfile.NamedTemporaryFile("w", suffix=".tsct") as scene:
            scene.write(record.SCENE)
            scene.flush()
            with Live(scene=scene.name, surface="none") as live, live.connect() as wall:
                said = self.node("console.mjs", live.link())
                self.assertRegex(said, r"asked \d+ requests\nmoved /thing and made /made; frame \d+ was shown\n")
                self.assertEqual(wall["/thing"].translation, (4.0, 5.0, 6.0))
                self.assertTrue(wall["/made"])

    def test_its_hash_is_the_library_s(self):
        dice = random.Random(1)
        texts = [dice.randbytes(size) for size in (*range(0, 260, 3), 240, 241, 1023, 1024, 1025, 4096, 5000)]
        seeds = [dice.getrandbits(64) for _ in texts]
        program = ("import {xxh3} from './xxh3.mjs'; for (const [hex, seed] of JSON.parse(process.argv[1])) "
                   "console.log(xxh3(Buffer.from(hex, 'hex'), BigInt(seed)).toString())")
        said = self.node("--input-type=module", "-e", program,
                         json.dumps([[text.hex(), str(seed)] for text, seed in zip(texts, seeds)]))
        self.assertEqual([int(line) for line in said.split()],
                         [_hash.hash64(text, seed) for text, seed in zip(texts, seeds)])


if __name__ == "__main__":
    unittest.main()
