"""The console's figures, read by the parser of those who made the format; and by others than the server's user."""
import importlib.util
import unittest
import urllib.error
import urllib.parse
import urllib.request

from live import PATIENCE, Live


def ask(link, path, token=True):
    url = urllib.parse.urlsplit(link)
    request = urllib.request.Request(f"{url.scheme}://{url.netloc}{path}")
    if token:
        request.add_header("Authorization", "Bearer " + urllib.parse.parse_qs(url.query)["token"][0])
    return urllib.request.urlopen(request, timeout=PATIENCE)


class Console(unittest.TestCase):
    @unittest.skipUnless(importlib.util.find_spec("prometheus_client"), "python3-prometheus-client is not installed (./deploy/set-up installs it)")
    def test_figures_are_openmetrics(self):
        from prometheus_client.openmetrics.parser import text_string_to_metric_families

        with Live(wall="2x2", surface="none") as live:
            answer = ask(live.link(), "/metrics")
            self.assertTrue(answer.headers["Content-Type"].startswith("application/openmetrics-text"))
            families = {family.name: family for family in text_string_to_metric_families(answer.read().decode())}
        self.assertTrue(all(name.startswith("tessera_") and family.documentation for name, family in families.items()))
        self.assertEqual({sample.labels["state"] for sample in families["tessera_host_up"].samples}, {"live"})
        self.assertEqual(len(families["tessera_host_up"].samples), 4)
        self.assertGreater(families["tessera_frames"].samples[0].value, 0)
        self.assertGreater(families["tessera_resident_bytes"].samples[0].value, 1e6)

    def test_without_a_token_nobody_is_told(self):
        with Live() as live:
            link = live.link()
            for path in ("/metrics", "/api", "/wall.jpg", "/"):
                with self.assertRaises(urllib.error.HTTPError) as refused:
                    ask(link, path, token=False)
                self.assertEqual(refused.exception.code, 401)
                refused.exception.close()
            self.assertEqual(ask(link, "/style.css", token=False).status, 200)


if __name__ == "__main__":
    unittest.main()
