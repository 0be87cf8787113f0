/// Walls whose hosts and people come in by keys: on this machine, and from machines of their own.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>

#include "common/base/Channel.h"
#include "common/codec/MessageCodec.h"
#include "common/net/TcpTransport.h"
#include "common/scene/FieldTable.h"
#include "server/tools/keys/KeysCommand.h"
#include "tests/drill/Network.h"
#include "tests/integration/ThreadWall.h"
#include "tests/unit/Eventually.h"

namespace tessera::test {
namespace {

using namespace std::chrono_literals;
using drill::NetworkNamespace;
using drill::SwitchedNetwork;

#define EXPECT_HAS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

/// A wall of one host, "all", and a folder of keys for it.
class WallByKeys : public testing::Test {
protected:
    void SetUp() override {
        keys({"init", "--wall", "1x1"});
        keys({"host", "all"});
        keys({"person", "ada", "--role", "editor"});
        keys({"person", "bob", "--role", "viewer"});
    }
    [[nodiscard]] std::string keyFolder(const std::string& name = "keys") const { return folder_.path() + "/" + name; }
    std::string keys(std::vector<std::string> words, const std::string& name = "keys") {
        words.insert(words.begin(), {"--keys", keyFolder(name)});
        testing::internal::CaptureStdout();
        const int code = runKeys(words);
        const std::string output = testing::internal::GetCapturedStdout();
        EXPECT_EQ(code, 0) << output;
        return output;
    }
    /// `host`: where it listens.
    void startServer(const std::string& host, std::vector<std::string> more) {
        std::vector<std::string> words = {"--wall",  "1x1", "--size",   "64x36",
                                          "--scene", kYard, "--listen", host + ":0"};
        words.insert(words.end(), more.begin(), more.end());
        server_ = std::make_unique<ThreadServer>(folder_.path(), words);
        const auto address = server_->waitForText("listening on ", 20s);
        ASSERT_TRUE(address) << server_->output();
        address_ = *address;
    }
    void startServerWithKeys(const std::string& host) { startServer(host, {"--keys", keyFolder()}); }
    /// A host that draws nothing, with the keys of a folder; empty: without.
    ThreadHost& client(const std::string& keys) {
        const TemporaryFolder& folder = *hostFolders_.emplace_back(std::make_unique<TemporaryFolder>());
        return *hosts_.emplace_back(std::make_unique<ThreadHost>(
            folder.path(),
            ThreadHost::Options{.server = *parseAddress(address_), .name = "all", .keys = keys, .surface = "none"}));
    }
    /// Hosts end with their server.
    void TearDown() override {
        for (const auto& host : hosts_) host->settle();
        if (server_) server_->stop();
        hosts_.clear();
    }
    [[nodiscard]] Outcome ctl(std::vector<std::string> words) const {
        words.insert(words.begin(), {"--server", address_});
        return ctlHere(words);
    }
    [[nodiscard]] std::string person(const std::string& name, const std::string& folder = "keys") const {
        return fmt::format("{}/person-{}.pem", keyFolder(folder), name);
    }

    TemporaryFolder folder_;
    std::unique_ptr<ThreadServer> server_;
    std::vector<std::unique_ptr<TemporaryFolder>> hostFolders_;
    std::vector<std::unique_ptr<ThreadHost>> hosts_;
    std::string address_;
};

TEST_F(WallByKeys, LetsInWhomTheKeysNameAsWhatTheySay) {
    startServerWithKeys("127.0.0.1");
    ThreadHost& host = client(keyFolder());
    ASSERT_TRUE(host.waitForText("joined the server", 20s)) << host.output() << server_->output();
    const Outcome ada = ctl({"--keys", person("ada"), "whoami"});
    EXPECT_EQ(ada.exitCode, 0) << ada.output;
    EXPECT_HAS(ada.output, "editor");
    EXPECT_HAS(ctl({"--keys", person("bob"), "whoami"}).output, "viewer");
    EXPECT_EQ(
        ctl({"--keys", person("ada"), "--timeout", "20", "set", "/row[0]", "translation", "0", "7", "0"}).exitCode, 0);
    const Outcome refused = ctl({"--keys", person("bob"), "set", "/row[0]", "translation", "0", "7", "0"});
    EXPECT_NE(refused.exitCode, 0);
    EXPECT_HAS(refused.output, "editor");
    const Outcome whose = ctl({"--keys", keyFolder(), "whoami"});
    EXPECT_EQ(whose.exitCode, 2) << whose.output;
    EXPECT_HAS(whose.output, "person-bob.pem");
    // The link that tessera-ctl tells is the one that the server has printed.
    const Outcome link = ctl({"link"});
    ASSERT_TRUE(link.output.starts_with("https://")) << link.output;
    EXPECT_HAS(server_->output(), "console: " + link.output);
    // Programs of the server's own user come in without a key, on this machine.
    EXPECT_HAS(ctl({"whoami"}).output, "operator");
}

TEST_F(WallByKeys, ClosesTheLinksOfARevokedNameAndTellsItWhy) {
    startServerWithKeys("127.0.0.1");
    ThreadHost& host = client(keyFolder());
    ASSERT_TRUE(host.waitForText("joined the server", 20s)) << host.output() << server_->output();
    keys({"renew", "all", "--out", keyFolder("stolen")});  // a second key of the same host
    keys({"revoke", "all"});
    EXPECT_EQ(host.waitForExit(20s), 4) << host.output();
    EXPECT_HAS(host.output(), "has been revoked");
    ThreadHost& other = client(keyFolder("stolen"));
    EXPECT_EQ(other.waitForExit(20s), 4) << other.output();
    EXPECT_HAS(other.output(), "has been revoked");
    // A new key lets it in again, without a restart of the server.
    keys({"host", "all"});
    ThreadHost& again = client(keyFolder());
    EXPECT_TRUE(again.waitForText("joined the server", 20s)) << again.output();
    EXPECT_FALSE(server_->waitForExit(0s)) << server_->output();
}

/// Of a person who has no key.
TEST_F(WallByKeys, AWordForSomeHoursIsARoleUntilItIsRevoked) {
    startServerWithKeys("127.0.0.1");
    const std::string said = keys({"token", "ci", "--role", "viewer", "--hours", "1"});
    const std::string word = said.substr(said.rfind('\n', said.size() - 2) + 1, 43);
    const std::string file = folder_.write("word", word + "\n");
    EXPECT_EQ(readText(keyFolder() + "/tokens").find(word), std::string::npos);
    const auto whoAmI = [&] { return ctl({"--token-file", file, "whoami"}); };
    EXPECT_TRUE(eventually([&] { return whoAmI().exitCode == 0; })) << "the server hears of the file soon";
    EXPECT_HAS(whoAmI().output, "viewer");
    const Outcome refused = ctl({"--token-file", file, "set", "/row[0]", "translation", "0", "7", "0"});
    EXPECT_NE(refused.exitCode, 0);
    EXPECT_HAS(refused.output, "editor");
    EXPECT_HAS(keys({"list"}), "token");
    keys({"revoke", "token/ci"});
    EXPECT_TRUE(eventually([&] { return whoAmI().exitCode != 0; }));
    EXPECT_HAS(whoAmI().output, "has ended");
}

TEST_F(WallByKeys, RefusesKeysOfOthersInWords) {
    keys({"init", "--wall", "1x1"}, "twin");
    keys({"host", "all"}, "twin");
    keys({"init", "--wall", "cave4"}, "cave");
    keys({"person", "ada", "--role", "operator"}, "cave");
    startServerWithKeys("127.0.0.1");
    ThreadHost& twin = client(keyFolder("twin"));
    EXPECT_EQ(twin.waitForExit(20s), 4) << twin.output();
    EXPECT_HAS(twin.output(), "another authority");
    const Outcome other = ctl({"--keys", person("ada", "cave"), "whoami"});
    EXPECT_EQ(other.exitCode, 4) << other.output;
    EXPECT_HAS(other.output, "another authority");
    ThreadHost& missing = client(folder_.path() + "/none");
    EXPECT_EQ(missing.waitForExit(20s), 3) << missing.output();
    EXPECT_HAS(missing.output(), "none");
    const TemporaryFolder words;
    ThreadServer server(words.path(), {"--wall", "1x1", "--scene", kYard, "--keys", keyFolder("cave")});
    EXPECT_EQ(server.waitForExit(20s), 3) << server.output();
    EXPECT_HAS(server.output(), "the server of the wall 'cave4', and this is the wall '1x1'");
}

TEST_F(WallByKeys, BeyondThisMachineTheServerWantsKeysOrAPersonsWord) {
    {
        const TemporaryFolder words;
        ThreadServer open(words.path(), {"--wall", "1x1", "--scene", kYard, "--listen", "0.0.0.0:0"});
        EXPECT_EQ(open.waitForExit(20s), 2) << open.output();
        EXPECT_HAS(open.output(), "tessera-keys --keys DIR init --wall 1x1");
    }
    Process server(folder_.path(), "server",
                   {program("tessera-server"), "--wall", "1x1", "--size", "64x36", "--scene", kYard, "--listen",
                    "0.0.0.0:0", "--insecure"});
    address_ = server.waitForText("listening on ", 20s).value_or("");
    EXPECT_HAS(server.output(), "may do all");
    EXPECT_HAS(ctl({"status"}).output, "--insecure: whoever comes from another machine may do all");
    server.signal(SIGTERM);  // which is no thread's that wrote the warning
    EXPECT_EQ(server.waitForExit(20s), 0) << server.output();
}

/// From machines of their own, in networks that this test made.
class WallOfMachines : public WallByKeys {
protected:
    void SetUp() override {
        WallByKeys::SetUp();
        try {
            network_ = std::make_unique<SwitchedNetwork>(2);
        } catch (const drill::RowSkipped& why) {
            GTEST_SKIP() << why.what();
        }
    }
    void startThere(std::vector<std::string> more) {
        const NetworkNamespace::Inside inside(&network_->server());
        startServer(network_->serverAddress(), std::move(more));
    }
    std::unique_ptr<SwitchedNetwork> network_;
};

TEST_F(WallOfMachines, NobodyComesInWithoutAKeyAndNobodyTriesTwice) {
    startThere({"--keys", keyFolder()});
    const NetworkNamespace::Inside inside(&network_->host(0));
    ThreadHost& without = client({});
    EXPECT_EQ(without.waitForExit(20s), 4) << without.output();
    EXPECT_EQ(without.output().find("dialling"), std::string::npos) << "it does not try twice: " << without.output();
    EXPECT_HAS(without.output(), "tessera-keys host all");
    const Outcome plain = ctl({"whoami"});
    EXPECT_EQ(plain.exitCode, 4) << plain.output;
    EXPECT_HAS(plain.output, "tessera-keys person");
    // A token goes to nobody whom others could hear.
    const std::string word = folder_.write("word", std::string(43, 'x') + "\n");
    EXPECT_EQ(ctl({"--token-file", word, "whoami"}).exitCode, 4);

    ThreadHost& with = client(keyFolder());
    EXPECT_TRUE(with.waitForText("joined the server", 20s)) << with.output();
    const Outcome ada = ctl({"--keys", person("ada"), "whoami"});
    EXPECT_EQ(ada.exitCode, 0) << ada.output;
    EXPECT_HAS(ada.output, "editor");
    const Outcome set =
        ctl({"--keys", person("ada"), "--timeout", "20", "set", "/row[0]", "translation", "0", "7", "0"});
    EXPECT_EQ(set.exitCode, 0) << set.output;
}

/// How long it takes until an application with this word is refused; none: it is not.
std::optional<std::chrono::steady_clock::duration> refusedAfter(const std::string& address, const std::string& word) {
    Channel<LinkEvent> events(100);
    TcpTransport transport({.maxPayload = maxPayloadBytes}, [&](LinkEvent event) { events.push(std::move(event)); });
    const auto from = std::chrono::steady_clock::now();
    const LinkId link = transport.connect(*parseAddress(address), 5s);
    const message::Hello hello{
        .schema = schemaHash(), .role = PeerRole::kApplication, .name = "guesses", .access = word};
    transport.send(link, wireType(Message(hello)), {}, share(encodeMessage(hello)));
    while (const std::optional<LinkEvent> event = events.popFor(20s)) {
        const auto* received = std::get_if<link_event::Received>(&event->what);
        if (std::holds_alternative<link_event::Closed>(event->what)) break;
        if (received == nullptr) continue;
        const Expected<Message> message = decodeMessage(received->type, received->payload);
        events.close();
        if (!message || !std::holds_alternative<message::Refused>(*message)) break;
        return std::chrono::steady_clock::now() - from;
    }
    events.close();
    return std::nullopt;
}

/// That it takes so long at least is true on a busy machine, too.
TEST_F(WallOfMachines, WrongTokensAreRefusedMoreSlowlyEachTime) {
    startThere({"--insecure"});
    const NetworkNamespace::Inside inside(&network_->host(0));
    for (int i = 0; i < 5; ++i) EXPECT_TRUE(refusedAfter(address_, "wrong"));
    EXPECT_GE(refusedAfter(address_, "wrong").value_or(0s), 1s);
    EXPECT_GE(refusedAfter(address_, "wrong").value_or(0s), 2s);
    EXPECT_TRUE(server_->waitForText("again and again", 20s)) << server_->output();
    EXPECT_FALSE(refusedAfter(address_, "")) << "who is let in is never slowed down";
}

TEST_F(WallOfMachines, TheConsoleRefusesWrongTokensMoreSlowlyEachTime) {
    startThere({"--insecure", "--console", network_->serverAddress() + ":0"});
    const auto link = server_->waitForText("console: http://", 20s);
    ASSERT_TRUE(link) << server_->output();
    const std::string place = link->substr(0, link->find('/'));
    const std::size_t colon = place.find(':');
    const NetworkNamespace::Inside inside(&network_->host(0));
    const auto get = [&](const std::string& word) {
        const std::string request = fmt::format(
            "GET /api HTTP/1.1\\r\\nHost: {}\\r\\nAuthorization: Bearer {}\\r\\nConnection: close"
            "\\r\\n\\r\\n",
            place, word);
        return run(folder_.path(),
                   {"/bin/bash", "-c",
                    fmt::format("exec 3<>/dev/tcp/{}/{}; printf '{}' >&3; head -1 <&3", place.substr(0, colon),
                                place.substr(colon + 1), request)},
                   20s)
            .output;
    };
    for (int i = 0; i < 5; ++i) EXPECT_HAS(get("wrong"), "401");
    const auto from = std::chrono::steady_clock::now();
    EXPECT_HAS(get("wrong"), "401");
    EXPECT_GE(std::chrono::steady_clock::now() - from, 1s);
    EXPECT_TRUE(server_->waitForText("again and again", 20s)) << server_->output();
    const std::size_t token = link->find("token=") + 6;
    EXPECT_HAS(get(link->substr(token, 43)), "200");
}

TEST_F(WallOfMachines, WhereTheServerHasNoKeysTheHostSaysSoAndGoesOnAsking) {
    startThere({"--insecure"});
    const NetworkNamespace::Inside inside(&network_->host(0));
    // A process, because it asks without end.
    Process sealed(
        folder_.path(), "client",
        {program("tessera-client"), "--server", address_, "--host", "all", "--surface", "none", "--keys", keyFolder()});
    EXPECT_TRUE(sealed.waitForText("has it keys", 20s)) << sealed.output();
    EXPECT_TRUE(sealed.running());
    ThreadHost& plain = client({});
    EXPECT_TRUE(plain.waitForText("joined the server", 20s)) << plain.output();
}

}  // namespace
}  // namespace tessera::test
