/// tessera-keys as a person meets it.
#include "server/tools/keys/KeysCommand.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "tests/unit/keys/KeysFixture.h"

namespace tessera {
namespace {

using namespace test;

TEST_F(KeysCommand, InitMakesAnAuthorityAndAServerOfAWall) {
    const std::string path = around_ / "deep/cave";
    const Ran ran = run({"--keys", path + "/", "init", "--wall", TESSERA_SOURCE_DIR "/deploy/walls/cave4.wall",
                         "--names", "wall.example,10.0.0.7"});
    ASSERT_EQ(ran.code, 0) << ran.err;
    EXPECT_EQ(filesIn(path), (std::set<std::string>{"authority.crt", "authority.pem", "issued", "server.pem"}));
    EXPECT_EQ(modeOf(path), 0700u);
    for (const std::string& file : filesIn(path)) EXPECT_EQ(modeOf(path + "/" + file), 0600u) << file;
    const Expected<Authority> authority = KeyFolder(path).authority();
    ASSERT_TRUE(authority) << authority.error().message;
    EXPECT_EQ(authority->wall(), "cave4");
    const Certificate server = certificateIn(path + "/server.pem");
    EXPECT_EQ(server.holder, (Identity{.wall = "cave4", .kind = Identity::Kind::kServer, .name = {}}));
    const Expected<std::vector<IssuedKey>> issued = KeyFolder(path).issued();
    ASSERT_TRUE(issued && issued->size() == 1);
    EXPECT_EQ(issued->front().serial, server.serial);
    EXPECT_EQ(issued->front().until, server.until);
    for (const std::string& part :
         {path + "/authority.pem", path + "/authority.crt", path + "/server.pem", authority->certificate().fingerprint,
          std::string("wall.example, 10.0.0.7"), "tessera-keys --keys " + path + " host NAME"})
        EXPECT_TRUE(contains(ran.out, part)) << part << "\n" << ran.out;
    const Expected<TlsKeys> keys = KeyFolder(path).ofServer();
    ASSERT_TRUE(keys) << keys.error().message;
    EXPECT_TRUE(TlsContext::make(*keys));
}

TEST_F(KeysCommand, InitKnowsTheServerByTheNamesOfThisMachineUnlessTold) {
    const Ran ran = run({"--keys", around_ / "own", "init", "--wall", TESSERA_SOURCE_DIR "/deploy/walls/cave4.wall"});
    EXPECT_EQ(ran.code, 0) << ran.err;
    EXPECT_TRUE(contains(ran.out, "localhost, 127.0.0.1, ::1")) << ran.out;
}

TEST_F(KeysCommand, InitLeavesAnAuthorityThatIsThereAlone) {
    const std::string before = textOf(keys_ + "/authority.pem");
    const Words init{"init", "--wall", TESSERA_SOURCE_DIR "/deploy/walls/cave4.wall"};
    EXPECT_TRUE(contains(refusal(1, init), "authority.pem: an authority is there already"));
    EXPECT_EQ(textOf(keys_ + "/authority.pem"), before);
    // The folder of a person: its keys would let nobody in any more.
    std::filesystem::remove(keys_ + "/authority.pem");
    EXPECT_TRUE(contains(refusal(1, init), "authority.crt: an authority is there already"));
}

/// Without the authority's key nothing has been made yet, wherever it was cut off.
TEST_F(KeysCommand, InitBeginsAnewWhereItWasCutOff) {
    const Words init{"init", "--wall", TESSERA_SOURCE_DIR "/deploy/walls/cave4.wall"};
    for (const char* file : {"issued", "server.pem", "authority.crt", "authority.pem"}) {
        const std::string path = around_ / (std::string("cut-") + file);
        const Words words{"--keys", path, "init", "--wall", TESSERA_SOURCE_DIR "/deploy/walls/cave4.wall"};
        const std::string blocks = path + "/." + file + ".new";
        std::filesystem::create_directories(blocks);  // so that it cannot be written
        ::chmod(path.c_str(), 0700);
        run(words);
        std::filesystem::remove(blocks);
        if (!std::filesystem::exists(path + "/authority.pem")) {
            const Ran ran = run(words);
            EXPECT_EQ(ran.code, 0) << file << ": " << ran.err;
        }
        EXPECT_EQ(filesIn(path), (std::set<std::string>{"authority.crt", "authority.pem", "issued", "server.pem"}));
        const Expected<TlsKeys> made = KeyFolder(path).ofServer();
        EXPECT_TRUE(made && TlsContext::make(*made)) << file;
        EXPECT_EQ(run({"--keys", path, "host", "left"}).code, 0) << file;
        EXPECT_EQ(run(words).code, 1) << "now it is there";
    }
    // Cut off at the very last step: all files are there, and the key has not its name yet.
    const std::string path = around_ / "cut-late";
    const Words words{"--keys", path, "init", "--wall", TESSERA_SOURCE_DIR "/deploy/walls/cave4.wall"};
    EXPECT_EQ(run(words).code, 0);
    std::filesystem::rename(path + "/authority.pem", path + "/authority.begun");
    const std::string former = textOf(path + "/authority.crt");
    EXPECT_TRUE(contains(run({"--keys", path, "host", "left"}).err, "authority.pem is not there"));
    EXPECT_EQ(run(words).code, 0);
    EXPECT_NE(textOf(path + "/authority.crt"), former);
    EXPECT_EQ(run({"--keys", path, "host", "left"}).code, 0);
    // Folders that are to have no key of the authority: of a server whose authority is in a safe, and of a host.
    said({"host", "left", "--out", around_ / "stick"});
    std::filesystem::remove(keys_ + "/authority.pem");
    EXPECT_TRUE(contains(refusal(1, init), "authority.crt: an authority is there already"));
    EXPECT_EQ(run({"--keys", around_ / "stick", "init", "--wall", init.back()}).code, 1);
    EXPECT_EQ(filesIn(around_ / "stick"), (std::set<std::string>{"authority.crt", "host-left.pem"}));
}

TEST_F(KeysCommand, InitThatFailsLeavesNoFolder) {
    const std::string path = around_ / "none";
    EXPECT_EQ(run({"--keys", path, "init", "--wall", around_ / "nowhere.wall"}).code, 3);
    const std::string wall = TESSERA_SOURCE_DIR "/deploy/walls/cave4.wall";
    for (const char* names : {"not a name", "a,,b", ",", "*.example"}) {
        const Ran ran = run({"--keys", path, "init", "--wall", wall, "--names", names});
        EXPECT_EQ(ran.code, 3) << names;
        EXPECT_TRUE(contains(ran.err, "neither a host name nor an address")) << ran.err;
    }
    EXPECT_FALSE(std::filesystem::exists(path));
}

TEST_F(KeysCommand, HostMakesItsKey) {
    const std::string text = said({"host", "left"});
    EXPECT_TRUE(contains(text, keys_ + "/host-left.pem: key of the host 'left' of the wall 'hall', until ")) << text;
    EXPECT_EQ(modeOf(keys_ + "/host-left.pem"), 0600u);
    const Certificate made = certificateIn(keys_ + "/host-left.pem");
    EXPECT_EQ(made.holder, host("left"));
    ASSERT_EQ(issued().size(), 2u);
    EXPECT_EQ(issued()[1].serial, made.serial);
    EXPECT_EQ(issued()[1].holder, host("left"));
    EXPECT_EQ(issued()[1].until, made.until);
    const Expected<TlsKeys> keys = folder_.ofHost("left");
    ASSERT_TRUE(keys);
    EXPECT_TRUE(TlsContext::make(*keys));
}

TEST_F(KeysCommand, PersonHasTheRoleThatIsSaid) {
    for (const Role role : {Role::kViewer, Role::kEditor, Role::kOperator}) {
        const std::string name = "Ada of " + std::string(nameOf(role)) + "s, 艾达";
        said({"person", name, "--role", std::string(nameOf(role))});
        EXPECT_EQ(certificateIn(keys_ + "/person-" + name + ".pem").holder, person(name, role));
        EXPECT_EQ(issued().back().holder, person(name, role));
    }
}

TEST_F(KeysCommand, WhatGoesElsewhereHasNoKeyOfTheAuthority) {
    const std::string out = around_ / "stick";
    const std::string text = said({"host", "left", "--out", out + "/"});
    said({"person", "ada", "--role", "editor", "--out", out});
    EXPECT_EQ(filesIn(out), (std::set<std::string>{"authority.crt", "host-left.pem", "person-ada.pem"}));
    EXPECT_EQ(modeOf(out), 0700u);
    for (const std::string& file : filesIn(out)) EXPECT_EQ(modeOf(out + "/" + file), 0600u) << file;
    EXPECT_EQ(filesIn(keys_), (std::set<std::string>{"authority.crt", "authority.pem", "issued", "server.pem"}));
    EXPECT_EQ(textOf(out + "/authority.crt"), authority_.certificatePem());
    EXPECT_EQ(issued().size(), 3u) << "recorded where the authority is";
    EXPECT_TRUE(contains(text, out + "/host-left.pem")) << text;
    const Expected<TlsKeys> keys = KeyFolder(out).ofHost("left");
    ASSERT_TRUE(keys) << keys.error().message;
    EXPECT_TRUE(TlsContext::make(*keys));
    // No file but the authority's own has its key.
    const std::string key = textOf(keys_ + "/authority.pem").substr(0, 200);
    for (const std::string& file : filesIn(out)) EXPECT_FALSE(contains(textOf(out + "/" + file), key)) << file;
    EXPECT_TRUE(contains(refusal(1, {"host", "left", "--out", out}), "renew makes another one"));
}

TEST_F(KeysCommand, FoldersThatCannotTakeKeysAreRefused) {
    EXPECT_TRUE(contains(refusal(2, {"host", "left", "--out", keys_}), "the folder of the keys itself"));
    EXPECT_TRUE(contains(refusal(2, {"host", "left", "--out", keys_ + "/../keys/"}), "the folder of the keys itself"));
    const std::string open = around_ / "open";
    std::filesystem::create_directory(open);
    ::chmod(open.c_str(), 0755);
    EXPECT_TRUE(contains(refusal(1, {"host", "left", "--out", open}), "--out: " + open));
    EXPECT_TRUE(filesIn(open).empty());
    // Of another wall: its keys would be beside a certificate that is not of their authority.
    const std::string other = around_ / "other";
    ASSERT_TRUE(KeyFolder::Writer::open(KeyFolder(other))
                    ->write("authority.crt", Authority::make("cave", inDays(0)).certificatePem()));
    EXPECT_TRUE(contains(refusal(1, {"host", "left", "--out", other}), "is of another authority"));
    EXPECT_EQ(filesIn(other), (std::set<std::string>{"authority.crt"}));
    EXPECT_TRUE(contains(refusal(1, {"host", "left", "--out", other + "/authority.crt/x"}), "cannot be made"));
}

TEST_F(KeysCommand, AKeyInUseIsNotReplacedUnasked) {
    said({"person", "ada", "--role", "viewer"});
    const std::string before = textOf(keys_ + "/person-ada.pem");
    const std::string again = refusal(1, {"person", "ada", "--role", "viewer"});
    EXPECT_TRUE(contains(again, "renew makes another one")) << again;
    const std::string other = refusal(1, {"person", "ada", "--role", "operator", "--out", around_ / "stick"});
    EXPECT_TRUE(contains(other, "viewer as before; for another role revoke it first")) << other;
    EXPECT_FALSE(std::filesystem::exists(around_ / "stick"));
    EXPECT_EQ(textOf(keys_ + "/person-ada.pem"), before);
    said({"host", "ada"});  // somebody else
    said({"revoke", "person/ada"});
    said({"person", "ada", "--role", "operator"});
    EXPECT_EQ(certificateIn(keys_ + "/person-ada.pem").holder, person("ada", Role::kOperator));
}

TEST_F(KeysCommand, NoKeyIsWrittenThatNobodyKnows) {
    std::filesystem::create_directory(keys_ + "/.host-left.pem.new");  // so that the key's file cannot be written
    const Ran ran = keys({"host", "left"});
    EXPECT_EQ(ran.code, 1) << ran.out;
    EXPECT_TRUE(contains(ran.err, "host-left.pem: cannot be written")) << ran.err;
    ASSERT_EQ(issued().size(), 2u) << "it is there before the key is";
    EXPECT_EQ(issued().back().holder, host("left"));
    // And where it cannot be, there is no key.
    std::filesystem::create_directory(keys_ + "/.issued.new");
    EXPECT_TRUE(contains(refusal(1, {"host", "right"}), "issued: cannot be written"));
}

TEST_F(KeysCommand, AKeyThatLetsNobodyInIsReplaced) {
    const auto ended = authority_.issue(host("left"), {}, inDays(-3), std::chrono::hours(24));
    const auto revoked = authority_.issue(host("right"), {}, inDays(0));
    ASSERT_TRUE(ended && revoked);
    std::vector<IssuedKey> all = issued();
    all.push_back({.serial = revoked->certificate.serial,
                   .holder = host("right"),
                   .until = revoked->certificate.until,
                   .revoked = true});
    {
        const Expected<KeyFolder::Writer> writer = KeyFolder::Writer::open(folder_);
        ASSERT_TRUE(writer->write("host-left.pem", ended->pem) && writer->write("host-right.pem", revoked->pem) &&
                    writer->write("host-torn.pem", "-----BEGIN") && writer->write(all));
    }
    for (const char* name : {"left", "right", "torn"}) {
        said({"host", name});
        EXPECT_GT(certificateIn(keys_ + "/host-" + name + ".pem").until, inDays(300)) << name;
    }
}

TEST_F(KeysCommand, NamesThatCannotBeThoseOfFilesAreRefused) {
    const std::string longest(64, 'x');
    said({"host", longest});
    const std::vector<std::string> bad{"",      ".",        "..",        ".hidden", "a/b",  "../x",  longest + "x",
                                       "a\nb",  "a\x1b[2J", "tab\t",     "\x7f",    "\xff", "a\xc3", "host/left",
                                       "/left", "left/",    "ends/../in"};
    for (const std::string& name : bad) {
        const std::string text = refusal(2, {"host", name});
        EXPECT_TRUE(contains(text, "is no name of a host or person") || name.empty()) << text;
        EXPECT_FALSE(contains(text, "\x1b")) << "a terminal obeys it";
        refusal(2, {"person", name, "--role", "viewer"});
    }
}

TEST_F(KeysCommand, ListSaysWhatIsGood) {
    issueUntil(host("left"), inDays(200));
    issueUntil(host("left"), inDays(300));
    issueUntil(host("right"), inDays(29));
    issueUntil(host("gone"), inDays(-1));
    issueUntil(person("ada", Role::kViewer), inDays(100), true);
    issueUntil(person("ada", Role::kOperator), inDays(100));
    issueUntil(person("bö", Role::kEditor), inDays(31));
    issueUntil(person("left", Role::kEditor), inDays(31));
    const std::vector<std::string> lines = listed();
    std::vector<std::string> states;
    for (const std::string& line : lines) states.push_back(line.substr(line.find("UTC") + 5));
    EXPECT_EQ(states, (std::vector<std::string>{"good", "good", "replaced", "good", "ends soon", "ended", "revoked",
                                                "good", "good", "good"}));
    const Certificate authority = authority_.certificate();
    EXPECT_EQ(lines[0], "authority  hall             " + authority.serial.substr(0, 8) + "  " +
                            toText(authority.until) + "  good");
    EXPECT_EQ(lines[1].rfind("server                      ", 0), 0u) << lines[1];
    EXPECT_EQ(lines[7], "person     ada    operator  40000000  " + toText(issued()[6].until) + "  good");
    EXPECT_EQ(lines[8], "person     bö     editor    40000000  " + toText(issued()[7].until) + "  good");
    EXPECT_TRUE(contains(said({"list"}), "key of     name   role      serial    until                 state\n"));
}

TEST_F(KeysCommand, ListNeedsNoKeyOfTheAuthority) {
    std::filesystem::remove(keys_ + "/authority.pem");
    EXPECT_EQ(listed().size(), 2u);
    EXPECT_TRUE(contains(refusal(3, {"host", "left"}), "authority.pem is not there"));
    std::filesystem::remove(keys_ + "/authority.crt");
    EXPECT_TRUE(contains(refusal(3, {"list"}), "authority.crt is not there"));
}

TEST_F(KeysCommand, RevokeMarksAllThatSomebodyHas) {
    said({"host", "left"});
    said({"renew", "left"});
    said({"renew", "left", "--out", around_ / "stick"});
    said({"host", "right"});
    std::filesystem::remove(keys_ + "/authority.pem");  // it needs no more than the list
    const std::string text = said({"revoke", "left"});
    EXPECT_TRUE(contains(text, "revoked the host 'left' of the wall 'hall': 3 keys; the server that reads " + keys_ +
                                   "/issued lets nobody in by them\n"))
        << text;
    EXPECT_TRUE(contains(text, "removed " + keys_ + "/host-left.pem\n")) << text;
    for (const IssuedKey& key : issued()) EXPECT_EQ(key.revoked, key.holder.name == "left") << key.holder.name;
    EXPECT_EQ(folder_.ofServer()->revoked.size(), 3u);
    EXPECT_FALSE(std::filesystem::exists(keys_ + "/host-left.pem"));
    EXPECT_TRUE(std::filesystem::exists(keys_ + "/host-right.pem"));
    EXPECT_EQ(stateOf("host       left"), "revoked");
    EXPECT_TRUE(contains(said({"revoke", "host/left"}), "had been revoked already"));
    EXPECT_EQ(modeOf(keys_ + "/issued"), 0600u);
}

/// It says "done" of a list: whether servers take the rest of the folder, too, shows there and then.
TEST_F(KeysCommand, RevokeWarnsOfAFolderThatNoServerCanRead) {
    const std::string server = keys_ + "/server.pem", authority = keys_ + "/authority.crt";
    const std::string serverText = textOf(server), authorityText = textOf(authority);
    const auto warning = [&](const std::string& name) {
        const Ran ran = keys({"revoke", name});
        EXPECT_EQ(ran.code, 0) << ran.err;
        EXPECT_TRUE(contains(ran.out, "revoked ")) << ran.out;
        EXPECT_EQ(ran.err.rfind("tessera-keys: warning: ", 0), 0u) << ran.err;
        EXPECT_EQ(std::ranges::count(ran.err, '\n'), 1) << ran.err;
        return ran.err;
    };
    for (const char* name : {"a", "b", "c", "d"}) said({"host", name});
    said({"token", "ci", "--role", "viewer"});
    ::chmod(server.c_str(), 0640);
    EXPECT_TRUE(contains(warning("a"), "chmod 600 " + server));
    EXPECT_TRUE(contains(warning("ci"), "chmod 600 " + server));
    ::chmod(server.c_str(), 0600);
    std::ofstream(server) << serverText.substr(0, 600);
    EXPECT_TRUE(contains(warning("b"), server + ": holds no certificate"));
    std::filesystem::remove(server);
    EXPECT_TRUE(contains(warning("c"), server + " is not there: tessera-keys --keys " + keys_ + " renew server"));
    {
        const Expected<KeyFolder::Writer> writer = KeyFolder::Writer::open(folder_);
        ASSERT_TRUE(writer->write("server.pem", serverText));
    }
    std::filesystem::remove(authority);
    EXPECT_TRUE(contains(warning("d"), authority));
    for (const IssuedKey& key : issued()) EXPECT_EQ(key.revoked, key.holder.kind == Identity::Kind::kHost);
    std::ofstream(authority) << authorityText;
    ::chmod(authority.c_str(), 0600);
    said({"revoke", "a"});
}

TEST_F(KeysCommand, WhoIsMeantIsSaid) {
    said({"host", "ada"});
    said({"person", "ada", "--role", "viewer"});
    for (const char* verb : {"revoke", "renew"}) {
        const std::string both = refusal(2, {verb, "ada"});
        EXPECT_TRUE(contains(both, "host/ada") && contains(both, "person/ada")) << both;
        EXPECT_TRUE(contains(refusal(3, {verb, "adda"}), "nobody called 'adda' has a key (did you mean 'ada'?)"));
        EXPECT_TRUE(contains(refusal(3, {verb, "person/adda"}), "(did you mean 'person/ada'?)"));
        EXPECT_TRUE(contains(refusal(3, {verb, "zzzzzzzzz"}), "nobody called 'zzzzzzzzz' has a key\n"));
    }
    said({"revoke", "person/ada"});
    EXPECT_EQ(stateOf("person     ada"), "revoked");
    EXPECT_EQ(stateOf("host       ada"), "good");
    EXPECT_FALSE(std::filesystem::exists(keys_ + "/person-ada.pem"));
    EXPECT_TRUE(std::filesystem::exists(keys_ + "/host-ada.pem"));
}

TEST_F(KeysCommand, TheServerCannotBeRevoked) {
    EXPECT_TRUE(contains(refusal(1, {"revoke", "server"}), "a new authority"));
    said({"host", "server"});
    EXPECT_TRUE(contains(refusal(1, {"revoke", "server"}), "a new authority"));
    said({"revoke", "host/server"});
    EXPECT_EQ(stateOf("host       server"), "revoked");
    EXPECT_EQ(stateOf("server"), "good");
}

TEST_F(KeysCommand, RenewMakesAnotherKeyAndLeavesTheFirstGood) {
    said({"person", "ada", "--role", "operator"});
    const Certificate before = certificateIn(keys_ + "/person-ada.pem");
    said({"renew", "ada", "person/ada"});
    const Certificate after = certificateIn(keys_ + "/person-ada.pem");
    EXPECT_NE(before.serial, after.serial);
    EXPECT_EQ(after.holder, person("ada", Role::kOperator));
    ASSERT_EQ(issued().size(), 3u) << "named twice, renewed once";
    EXPECT_FALSE(issued()[1].revoked);
    EXPECT_EQ(issued()[2].serial, after.serial);
    said({"renew", "ada", "--out", around_ / "stick"});
    EXPECT_EQ(filesIn(around_ / "stick"), (std::set<std::string>{"authority.crt", "person-ada.pem"}));
    EXPECT_EQ(certificateIn(keys_ + "/person-ada.pem").serial, after.serial) << "not here";
    EXPECT_EQ(issued().size(), 4u);
}

TEST_F(KeysCommand, RenewWithoutNamesTakesWhatEndsSoon) {
    EXPECT_EQ(said({"renew"}), "no key ends within 30 days\n");
    issueUntil(host("left"), inDays(29));
    issueUntil(host("late"), inDays(-9));
    issueUntil(host("right"), inDays(31));
    issueUntil(host("again"), inDays(3));
    issueUntil(host("again"), inDays(200));
    issueUntil(person("ada", Role::kEditor), inDays(3), true);
    said({"renew"});
    std::set<std::string> names = filesIn(keys_);
    EXPECT_EQ(names, (std::set<std::string>{"authority.crt", "authority.pem", "host-late.pem", "host-left.pem",
                                            "issued", "server.pem"}));
    EXPECT_EQ(issued().size(), 9u);
    EXPECT_EQ(stateOf("host       left"), "good");
    EXPECT_EQ(said({"renew"}), "no key ends within 30 days\n");
    const std::string all = said({"renew", "--all", "--out", around_ / "stick"});
    EXPECT_EQ(filesIn(around_ / "stick"), (std::set<std::string>{"authority.crt", "host-again.pem", "host-late.pem",
                                                                 "host-left.pem", "host-right.pem"}));
    EXPECT_TRUE(contains(all, keys_ + "/server.pem")) << "it stays where its server is: " << all;
    EXPECT_EQ(issued().size(), 14u);
    // Revoked ones are let in again only where they are named.
    EXPECT_TRUE(contains(said({"renew", "ada"}), "had been revoked, and is let in again"));
    EXPECT_EQ(stateOf("person     ada"), "good");
}

TEST_F(KeysCommand, RenewNamesTheServer) {
    const Certificate before = certificateIn(keys_ + "/server.pem");
    EXPECT_TRUE(
        contains(said({"renew", "server", "--names", "hall.example"}), "browsers know the server as hall.example\n"));
    const Certificate after = certificateIn(keys_ + "/server.pem");
    EXPECT_NE(before.serial, after.serial);
    EXPECT_EQ(after.holder, before.holder);
    EXPECT_TRUE(
        contains(said({"renew", "server"}), "browsers know the server as hall.example\n"));  // it keeps its names
    said({"host", "left"});
    EXPECT_TRUE(contains(refusal(2, {"renew", "left", "--names", "a"}), "--names are the server's"));
    EXPECT_TRUE(contains(refusal(2, {"renew", "server", "--out", around_ / "stick"}), "--out is for hosts and people"));
    EXPECT_TRUE(contains(refusal(2, {"renew", "left", "--all"}), "--all"));
    EXPECT_TRUE(contains(refusal(3, {"renew", "server", "--names", "a b"}), "neither a host name nor an address"));
}

TEST_F(KeysCommand, AnAuthorityThatHasEndedMakesNothing) {
    const Authority old = Authority::make("hall", inDays(-3660));
    {
        const Expected<KeyFolder::Writer> writer = KeyFolder::Writer::open(folder_);
        ASSERT_TRUE(writer->write("authority.pem", old.pem()));
        ASSERT_TRUE(writer->write("authority.crt", old.certificatePem()));
    }
    EXPECT_TRUE(contains(refusal(1, {"host", "left"}), "the authority held until "));
    EXPECT_EQ(stateOf("authority"), "ended");
}

TEST_F(KeysCommand, AuthorityIsExportedForBrowsers) {
    const mode_t before = ::umask(0022);
    const std::string file = around_ / "hall.crt";
    const std::string text = said({"authority", file});
    EXPECT_EQ(modeOf(file), 0644u);
    ::umask(0077);
    said({"authority", around_ / "mine.crt"});
    EXPECT_EQ(modeOf(around_ / "mine.crt"), 0600u);
    ::umask(before);
    EXPECT_EQ(textOf(file), authority_.certificatePem());
    EXPECT_TRUE(contains(text, authority_.certificate().fingerprint)) << text;
    const Ran piped = keys({"authority", "-"});
    EXPECT_EQ(piped.code, 0);
    EXPECT_EQ(piped.out, authority_.certificatePem()) << "nothing else is in the way of who reads it";
    EXPECT_TRUE(contains(piped.err, authority_.certificate().fingerprint)) << piped.err;
    const std::string key = textOf(keys_ + "/authority.pem");
    EXPECT_TRUE(contains(refusal(2, {"authority", keys_ + "/authority.pem"}), "in the folder of the keys"));
    EXPECT_EQ(textOf(keys_ + "/authority.pem"), key);
    EXPECT_TRUE(contains(refusal(1, {"authority", around_ / "no/such.crt"}), "cannot be written"));
}

/// The name is replaced, not what it leads to.
TEST_F(KeysCommand, AuthorityIsNotWrittenThroughLinks) {
    const std::string key = textOf(keys_ + "/authority.pem"), file = around_ / "hall.crt";
    std::filesystem::create_symlink(keys_ + "/authority.pem", file);
    said({"authority", file});
    EXPECT_FALSE(std::filesystem::is_symlink(file));
    EXPECT_EQ(textOf(file), authority_.certificatePem());
    std::filesystem::remove(file);
    std::filesystem::create_hard_link(keys_ + "/authority.pem", file);
    said({"authority", file});
    EXPECT_EQ(textOf(file), authority_.certificatePem());
    EXPECT_EQ(textOf(keys_ + "/authority.pem"), key);
    EXPECT_EQ(modeOf(keys_ + "/authority.pem"), 0600u);
    said({"authority", file});  // again
    EXPECT_EQ(filesIn(around_ / ""), (std::set<std::string>{"hall.crt", "keys"})) << "nothing else is left";
    ASSERT_EQ(::mkfifo((around_ / "pipe").c_str(), 0600), 0);
    EXPECT_TRUE(contains(refusal(1, {"authority", around_ / "pipe"}), "is no file"));
    EXPECT_TRUE(contains(refusal(1, {"authority", around_ / ""}), "is no file"));
}

TEST_F(KeysCommand, AFolderThatIsNotThereIsNotMade) {
    const std::string none = around_ / "none";
    for (const Words& words : {Words{"host", "a"}, Words{"person", "a", "--role", "viewer"}, Words{"list"},
                               Words{"revoke", "a"}, Words{"renew"}, Words{"authority", "-"}}) {
        Words all{"--keys", none};
        all.insert(all.end(), words.begin(), words.end());
        const Ran ran = run(all);
        EXPECT_EQ(ran.code, 3) << words[0];
        EXPECT_TRUE(contains(ran.err, "tessera-keys --keys " + none + " init --wall W makes it")) << ran.err;
    }
    EXPECT_FALSE(std::filesystem::exists(none));
}

TEST_F(KeysCommand, FilesThatOthersMayReadAreRefused) {
    ::chmod((keys_ + "/authority.pem").c_str(), 0640);
    EXPECT_TRUE(contains(refusal(1, {"host", "left"}), "chmod 600"));
    ::chmod((keys_ + "/authority.pem").c_str(), 0600);
    ::chmod(keys_.c_str(), 0750);
    EXPECT_TRUE(contains(refusal(1, {"host", "left"}), "chmod 700"));
    ::chmod(keys_.c_str(), 0700);
    std::ofstream(keys_ + "/issued") << "rubbish\nend\n";
    EXPECT_TRUE(contains(refusal(3, {"list"}), "issued:1: "));
    EXPECT_TRUE(contains(refusal(3, {"revoke", "left"}), "issued:1: "));
}

TEST_F(KeysCommand, WordsThatMakeNoSenseAreRefused) {
    EXPECT_TRUE(contains(refusal(2, {}), "VERB is required"));
    EXPECT_TRUE(contains(refusal(2, {"hots", "left"}), "there is no verb 'hots' (did you mean 'host'?)"));
    EXPECT_TRUE(contains(refusal(2, {"--quiet", "list"}), "--quiet"));
    EXPECT_TRUE(contains(refusal(2, {"init"}), "--wall is required"));
    EXPECT_TRUE(contains(refusal(2, {"host"}), "NAME is required"));
    EXPECT_TRUE(contains(refusal(2, {"host", "a", "b"}), "b"));
    EXPECT_TRUE(contains(refusal(2, {"person"}), "required"));
    EXPECT_TRUE(contains(refusal(2, {"person", "ada"}), "--role is required"));
    EXPECT_TRUE(contains(refusal(2, {"person", "ada", "--role", "boss"}), "boss not in {viewer,editor,operator}"));
    EXPECT_TRUE(contains(refusal(2, {"person", "ada", "--role", "viewer", "--out", ""}), "is empty"));
    EXPECT_TRUE(contains(refusal(2, {"revoke"}), "(NAME), or"));
    EXPECT_TRUE(contains(refusal(2, {"authority"}), "FILE is required"));
    EXPECT_TRUE(contains(refusal(2, {"list", "--keys", keys_}), "--keys"));
    EXPECT_EQ(run({"--keys"}).code, 2);
    EXPECT_EQ(run({"--keys", "", "list"}).code, 2);
}

TEST_F(KeysCommand, HelpHasAtMostEightyColumns) {
    EXPECT_EQ(run({"--version"}).out.rfind("tessera-keys ", 0), 0u);
    for (const Words& words :
         {Words{"--help"}, Words{"init", "--help"}, Words{"host", "--help"}, Words{"person", "--help"},
          Words{"list", "--help"}, Words{"revoke", "--help"}, Words{"renew", "--help"}, Words{"authority", "--help"}}) {
        const Ran ran = run(words);
        EXPECT_EQ(ran.code, 0) << words[0];
        EXPECT_TRUE(contains(ran.out, "(keys, in the current folder)")) << ran.out;
        std::istringstream text(ran.out);
        for (std::string line; std::getline(text, line);) EXPECT_LE(line.size(), 80u) << line;
    }
}

/// The lock is the folder's, and "issued" is read with it.
TEST_F(KeysCommand, SeveralAtOnceLoseNothing) {
    constexpr int kPrograms = 8;
    std::vector<pid_t> programs;
    for (int i = 0; i < kPrograms; ++i) {
        const pid_t child = ::fork();
        if (child == 0) {
            if (std::freopen("/dev/null", "w", stdout) == nullptr) ::_exit(9);
            ::_exit(runKeys({"--keys", keys_, "host", "h" + std::to_string(i)}));
        }
        programs.push_back(child);
    }
    for (const pid_t child : programs) {
        int status = -1;
        EXPECT_EQ(::waitpid(child, &status, 0), child);
        EXPECT_EQ(status, 0);
    }
    EXPECT_EQ(issued().size(), 1u + kPrograms);
    EXPECT_EQ(filesIn(keys_).size(), 4u + kPrograms);
}

}  // namespace
}  // namespace tessera
