"""The table of secrets in security.md: each thing that ends one has tests, and they are there."""
import pathlib
import re
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
ANOTHER_PROTECTION = ("LocalLinks.EndWhereTheProtectionIsAnotherOne", "TokensHunt.ATokenLetsInAsLongAsTheModelSays",
                      "tokens.test_tokens_end_where_the_wall_is_protected_otherwise")
REVOKED_LINKS = ("TokensHunt.ATokenLetsInAsLongAsTheModelSays", "LocalLinks.TokensOfARunningServerFollowTheMarkAndThe"
                 "Authority", "tokens.test_revoked_links_end_while_the_server_runs_and_stay_so")
ITS_TIME = ("TlsChannel.ExpiryIsToldWithBothClocks",)
NEW_AUTHORITY = ("TlsChannel.AnAuthorityOfTheSameNameIsAnother",)

# By the beginning of a row's first cell: for each entry of its last cell the tests that show it.
TESTS = {
    "token of the server": [ANOTHER_PROTECTION, REVOKED_LINKS,
                            ("access.test_the_token_is_looked_up_each_time_that_a_server_is_dialled",)],
    "token of `--token-file`": [("LocalLinks.OfAChosenTokenServeAsLongAsItIsNamed",),
                                ("ChosenTokensTest.EndWithTheProtectionOfTheirServer", ANOTHER_PROTECTION[1],
                                 "tokens.test_a_chosen_token_stays_with_its_protection_over_a_restart_of_the_machine"),
                                ("tokens.test_a_token_that_a_person_chose_ends_too_and_the_server_says_so",
                                 "tokens.test_a_chosen_token_that_was_revoked_stays_so_over_a_restart_of_the_machine",
                                 "ChosenTokensTest.ThatEndedAreAllRemembered")],
    "token of `--panel`": [(REVOKED_LINKS[2],), ("SealedDoor.SendsAwayWhoseTokenIsRenewed", REVOKED_LINKS[2])],
    "token of `tessera-keys token`": [("SealedDoor.SendsAwayWhoseTokenEnds", "ServerAccess.AWordThatHasEndedLetsNobody"
                                       "InNorGoOn"),
                                      ("TokensCommand.TokensAreShownOnceAndKeptAsHashes",
                                       "WallByKeys.AWordForSomeHoursIsARoleUntilItIsRevoked"),
                                      ("LinksCommand.AllTokensAndLinksOfAWallEndAtOnce", *REVOKED_LINKS),
                                      ("LinksCommand.TokensEndWithTheirAuthority",)],
    "key of the authority": [("KeysCommand.AnAuthorityThatHasEndedMakesNothing",), NEW_AUTHORITY],
    "key of the server": [ITS_TIME, NEW_AUTHORITY],
    "key of a host or person": [ITS_TIME, ("SealedDoor.SendsAwayAtOnceWhoseKeyIsRevoked",
                                           "TlsChannel.RevokedSerialsLetNobodyIn"), NEW_AUTHORITY],
    "keys of `tessera-wall --start`": [("WallKeys.OfOneRunGoWithItAndTheNextRunHasOthers",)],
    "session of TLS": [("TlsChannel.RevokedSerialsLetNobodyIn",)],
    "token by which the console": [("LocalLinks.TheConsolesOwnTokenIsAnotherInEachRun",)],
    "token that joins": [("ServerJoin.ATokenEndsWithItsControlConnection",)],
    "token in a browser": [("page_scene.test_a_token_that_counts_no_more_is_asked_for_on_the_page",
                            "page_panel.test_a_token_that_is_taken_back_says_so")],
}


def rows():
    """Of the table: its first and last cells."""
    lines = (ROOT / "deploy/security.md").read_text().splitlines()
    begin = lines.index("| secret | where it lives | life | what ends it |") + 2
    for line in lines[begin:]:
        if not line.startswith("|"):
            return
        cells = [cell.strip() for cell in line.strip("|").split(" | ")]
        yield cells[0], cells[-1]


def tests_that_are_there():
    found = set()
    for path in ROOT.glob("tests/**/*.cpp"):
        found.update(".".join(names) for names in re.findall(r"^TEST(?:_F|_P)?\((\w+), (\w+)\)", path.read_text(),
                                                              re.MULTILINE))
    for path in ROOT.glob("tests/python/test_*.py"):
        found.update(f"{path.stem.removeprefix('test_')}.{name}"
                     for name in re.findall(r"^    def (test_\w+)\(", path.read_text(), re.MULTILINE))
    return found


class Secrets(unittest.TestCase):
    def test_each_row_of_the_table_has_its_tests(self):
        there = list(rows())
        for secret, ends in there:
            known = [tests for start, tests in TESTS.items() if secret.startswith(start)]
            self.assertEqual(len(known), 1, f"{secret}: say in TESTS which tests show what ends it")
            self.assertEqual(len(known[0]), len(ends.split("; ")), f"{secret}: {ends}")
        for start in TESTS:
            self.assertTrue(any(secret.startswith(start) for secret, _ in there), f"{start}: has no row")

    def test_the_tests_are_there(self):
        found = tests_that_are_there()
        for secret, entries in TESTS.items():
            for tests in entries:
                for test in tests:
                    self.assertTrue(test in found, f"{secret}: there is no test {test}")


if __name__ == "__main__":
    unittest.main()
