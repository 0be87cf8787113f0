/// Who is let in, what a target says, what a message on a socket is.
#include <gtest/gtest.h>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <net/if.h>

#include <nlohmann/json.hpp>

#include "server/door/Envelope.h"
#include "server/door/Gatekeeper.h"
#include "server/door/Metrics.h"
#include "tests/support/words/Words.h"
#include "tests/unit/tls/WallOfKeys.h"

namespace tessera {
namespace {

int verdict(HttpRequest request, const DoorReach& reach = {}, std::uint16_t port = 7001) {
    const Gatekeeper gate({{"looks", "changes", "secret"}}, port, reach);
    const std::optional<HttpTarget> target = readTarget(request.target);
    if (!target) return 400;
    const tl::expected<Entrant, HttpAnswer> who = gate.entrantOf(request, *target);
    return who ? 200 : who.error().status;
}

TEST(Gatekeeper, LetsInThisMachinesPagesWithTheToken) {
    const std::string bearer = "Bearer secret";
    for (const std::string host : {"127.0.0.1:7001", "localhost:7001", "[::1]:7001"}) {
        EXPECT_EQ(verdict({.target = "/api", .host = host, .authorization = bearer}), 200) << host;
        EXPECT_EQ(verdict({.target = "/api", .host = host, .origin = "http://" + host, .authorization = bearer}), 200)
            << host;
    }
    // Names of hosts and of schemes have no case.
    EXPECT_EQ(verdict({.target = "/api", .host = "LocalHost:7001", .authorization = bearer}), 200);
    EXPECT_EQ(verdict({.target = "/api", .host = "127.0.0.1:7001", .authorization = "bEARER secret"}), 200);
    EXPECT_EQ(
        verdict(
            {.target = "/api", .host = "127.0.0.1:7001", .origin = "HTTP://LOCALHOST:7001", .authorization = bearer}),
        200);
    EXPECT_EQ(verdict({.target = "/?token=secret", .host = "localhost:7001"}), 200);
    EXPECT_EQ(verdict({.target = "/socket?changes=1&token=secret", .host = "localhost:7001"}), 200);
}

TEST(Gatekeeper, TellsRolesByTheirTokens) {
    const Gatekeeper gate({{"looks", "changes", "secret"}}, 7001);
    const auto roleOf = [&](const std::string& token) {
        const HttpRequest request{.target = "/api", .host = "localhost:7001", .authorization = "Bearer " + token};
        return gate.entrantOf(request, *readTarget("/api")).value().role;
    };
    EXPECT_EQ(roleOf("looks"), Role::kViewer);
    EXPECT_EQ(roleOf("changes"), Role::kEditor);
    EXPECT_EQ(roleOf("secret"), Role::kOperator);
}

TEST(Gatekeeper, LetsVisitorsInToAPanelOfTheServersAlone) {
    const Gatekeeper gate({{"looks", "changes", "secret"}}, 7001, {}, "me",
                          {{"word", "0123", "Hall"}, {"other", "4567", "Yard"}});
    const auto entrant = [&](const std::string& token) {
        const HttpRequest request{.target = "/", .host = "localhost:7001", .authorization = "Bearer " + token};
        EXPECT_EQ(gate.tokenIn(request, *readTarget("/")), gate.knows(token) ? token : "");
        return gate.entrantOf(request, *readTarget("/"));
    };
    ASSERT_TRUE(entrant("word"));
    EXPECT_EQ(entrant("word")->panel, "0123");
    EXPECT_EQ(entrant("word")->role, Role::kEditor);
    EXPECT_EQ(entrant("other")->panel, "4567");
    EXPECT_EQ(entrant("secret")->panel, "");
    EXPECT_FALSE(entrant("wor"));
}

TEST(Gatekeeper, RefusesTokensThatWereRenewedAndNamesTheCure) {
    Gatekeeper gate({{"looks", "changes", "secret"}}, 7001, {}, "me", {{"visit", "0123", "Hall"}});
    const auto answer = [&](const std::string& token) {
        const HttpRequest request{.target = "/api", .host = "localhost:7001", .authorization = "Bearer " + token};
        const auto who = gate.entrantOf(request, *readTarget("/api"));
        return who ? std::string("let in") : std::to_string(who.error().status) + " " + who.error().body;
    };
    for (const char* token : {"looks", "changes", "secret", "visit"}) EXPECT_EQ(answer(token), "let in") << token;
    gate.renew({{"looks anew", "changes anew", "secret anew"}}, {{"visit anew", "0123", "Hall"}});
    for (const std::string token : {"looks", "changes", "secret", "visit"}) {
        EXPECT_FALSE(gate.knows(token));
        EXPECT_TRUE(answer(token).starts_with("401 ")) << answer(token);
        EXPECT_WORDS(answer(token));
        EXPECT_EQ(answer(token + " anew"), "let in");
    }
}

TEST(Gatekeeper, KeepsOutEverybodyElse) {
    const std::string bearer = "Bearer secret";
    // A name that was pointed at this machine; another port; none.
    for (const std::string host : {"evil.example:7001", "127.0.0.1:7002", "127.0.0.1", "", "127.0.0.1:7001:7001",
                                   "localhost.evil:7001", "0.0.0.0:7001"})
        EXPECT_EQ(verdict({.target = "/api", .host = host, .authorization = bearer}), 421) << host;
    for (const std::string origin : {"http://evil.example", "https://127.0.0.1:7001", "http://127.0.0.1:7002", "null",
                                     "file://", "http://127.0.0.1:7001@evil"})
        EXPECT_EQ(verdict({.target = "/api", .host = "127.0.0.1:7001", .origin = origin, .authorization = bearer}), 403)
            << origin;
    for (const std::string wrong :
         {"", "Bearer", "Bearer ", "Bearer secre", "Bearer secrets", "Bearer SECRET", "Basic secret", "secret"})
        EXPECT_EQ(verdict({.target = "/api", .host = "127.0.0.1:7001", .authorization = wrong}), 401) << wrong;
    // In the query it counts for page and socket alone: other links may be kept by whoever they pass.
    for (const std::string target :
         {"/api?token=secret", "/metrics?token=secret", "/?token=Secret", "/socket?token=", "/socket?Token=secret"})
        EXPECT_EQ(verdict({.target = target, .host = "127.0.0.1:7001"}), 401) << target;
}

/// Of this machine's interfaces but loopback's; none in a machine without a network.
std::vector<std::string> ownAddresses() {
    std::vector<std::string> found;
    ifaddrs* all = nullptr;
    if (::getifaddrs(&all) != 0) return found;
    for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next) {
        std::array<char, INET_ADDRSTRLEN> text{};
        if (one->ifa_addr == nullptr || one->ifa_addr->sa_family != AF_INET || (one->ifa_flags & IFF_LOOPBACK) != 0)
            continue;
        ::inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in*>(one->ifa_addr)->sin_addr, text.data(), text.size());
        found.emplace_back(text.data());
    }
    ::freeifaddrs(all);
    return found;
}

TEST(Gatekeeper, KnowsThisMachinesAddressesAndTheCertificatesNamesWhereOthersReachIt) {
    const std::string bearer = "Bearer secret";
    const test::WallOfKeys wall;
    const auto own = wall.authority().issue(wall.server(), {"Wall.Example", "192.0.2.7", "2001:db8::7"},
                                            std::chrono::system_clock::now());
    const DoorReach sealed{.keys = [keys = test::contextOf(wall.keysWith(own->pem))] { return keys; }};
    const DoorReach open{.keys = {}, .open = true};
    const auto from = [&](const std::string& host, const std::string& origin, const DoorReach& reach,
                          std::uint16_t port = 7001) {
        return verdict({.target = "/api", .host = host, .origin = origin, .authorization = bearer}, reach, port);
    };
    for (const std::string name :
         {"wall.example:7001", "WALL.example:7001", "192.0.2.7:7001", "[2001:db8::7]:7001", "[2001:DB8:0::7]:7001"}) {
        EXPECT_EQ(from(name, "https://" + name, sealed), 200) << name;
        EXPECT_EQ(from(name, "http://" + name, sealed), 403) << name;
        EXPECT_EQ(from(name, "", {}), 421) << name;
        EXPECT_EQ(from(name, "", open), 421) << "no certificate: " << name;
    }
    for (const std::string& address : ownAddresses()) {
        const std::string name = address + ":7001";
        EXPECT_EQ(from(name, "https://" + name, sealed), 200) << name;
        EXPECT_EQ(from(name, "http://" + name, open), 200) << name;
        EXPECT_EQ(from(name, "https://" + name, open), 403) << name;
        EXPECT_EQ(from(address + ":7002", "", open), 421) << name;
        EXPECT_EQ(from(name, "", {}), 421) << name;
    }
    for (const DoorReach& reach : {sealed, open}) {
        for (const std::string name : {"evil.example:7001", "192.0.2.8:7001", "wall.example:7002", "wall.example",
                                       "0.0.0.0:7001", "wall.example.evil:7001", "", ":7001"})
            EXPECT_EQ(from(name, "", reach), 421) << name;
        for (const std::string origin : {"https://evil.example:7001", "https://192.0.2.8:7001", "null"})
            EXPECT_EQ(from("localhost:7001", origin, reach), 403) << origin;
    }
    // The port that the scheme stands for is not said.
    EXPECT_EQ(from("wall.example", "https://wall.example", sealed, 443), 200);
    EXPECT_EQ(from("[2001:db8::7]", "", sealed, 443), 200);
    EXPECT_EQ(from("wall.example", "", sealed, 80), 421);
    EXPECT_EQ(from("localhost", "http://localhost", open, 80), 200);
}

TEST(Gatekeeper, LetsInByKeyBeforeAToken) {
    const auto answer = [](const Credential& key) {
        const Gatekeeper gate({{"looks", "changes", "secret"}}, 7001);
        const HttpRequest request{
            .target = "/api", .host = "localhost:7001", .authorization = "Bearer secret", .key = key};
        return gate.entrantOf(request, *readTarget("/api"));
    };
    const test::WallOfKeys wall;
    for (const Role role : {Role::kViewer, Role::kEditor, Role::kOperator})
        EXPECT_EQ(answer({.identity = wall.person("anna", role), .serial = "1"}).value(),
                  (Entrant{role, Entrant::By::kKey, "anna"}));
    const Identity anna = wall.person("anna", Role::kOperator);
    for (const Credential& wrong : {Credential{.identity = anna, .serial = "1", .fault = "it has ended"},
                                    Credential{.identity = wall.host("left"), .serial = "1"},
                                    Credential{.identity = wall.server(), .serial = "1"}}) {
        const auto refused = answer(wrong);
        ASSERT_FALSE(refused);
        EXPECT_EQ(refused.error().status, 403);
        EXPECT_WORDS(refused.error().body);
    }
}

TEST(HttpTarget, IsTakenApartOrRefused) {
    const std::optional<HttpTarget> target = readTarget("/tile/front%200%2C1.png?token=a%2Bb&x&y=1+2&y=3");
    ASSERT_TRUE(target);
    EXPECT_EQ(target->path, "/tile/front 0,1.png");
    EXPECT_EQ(target->query, (std::map<std::string, std::string>{{"token", "a+b"}, {"x", ""}, {"y", "1 2"}}));
    for (const std::string_view wrong : {"", "api", "http://x/", "/%", "/%4", "/%zz", "/a%00b", "/a%0ab", "/?x=%0d"})
        EXPECT_FALSE(readTarget(wrong)) << wrong;
}

TEST(RateLimit, LetsSoManyThroughInASecond) {
    RateLimit rate(100, 200);
    const auto start = std::chrono::steady_clock::now();
    std::size_t passed = 0;
    for (int ms = 0; ms < 10'000; ++ms)
        for (int i = 0; i < 3; ++i) passed += rate.take(start + std::chrono::milliseconds(ms));
    EXPECT_NEAR(static_cast<double>(passed), 200 + 10 * 100, 2);
}

TEST(Envelope, SaysWhatIsAskedOrWhatIsWrong) {
    const ApiExpected<Envelope> sound =
        readEnvelope(R"({"id":"a\"b","request":"GetStatus","fields":{},"binaries":2})").envelope;
    ASSERT_TRUE(sound);
    EXPECT_EQ(sound->id, R"("a\"b")");
    EXPECT_EQ(sound->binaries, 2u);
    const std::pair<std::string_view, std::string_view> wrong[] = {
        {"[]", ""},
        {"{}", "request"},
        {R"({"request":7})", "request"},
        {R"({"id":1.5,"request":"A"})", "id"},
        {R"({"id":{},"request":"A"})", "id"},
        {R"({"id":1,"request":"A","binaries":-1})", "binaries"},
        {R"({"id":1,"request":"A","binaries":99999})", "binaries"},
        {R"({"id":1,"reqest":"A"})", "reqest"}};
    for (const auto& [text, field] : wrong) {
        const SaidEnvelope read = readEnvelope(text);
        ASSERT_FALSE(read.envelope) << text;
        EXPECT_EQ(read.envelope.error().field, field) << text;
        // Whatever else is wrong, the answer says to which message.
        EXPECT_EQ(read.id, text.starts_with(R"({"id":1,)") ? "1" : "") << text;
    }
    for (const std::string& said :
         {answerText("7", "Done", Json::object(), 0), answerText("", "Done", Json::object(), 3),
          errorText("\"x\"", {ErrorCode::kLimit, "too \"many\"", "a.b"}), noticeText("Frame", Json::object(), 0),
          changesText(Sequence(3), {}, true), changesText(Sequence(3), {}, false)})
        EXPECT_TRUE(parseJson(said)) << said;
}

TEST(Metrics, AreLinesOfTheFormatWhateverNamesSay) {
    answer::Status status;
    status.hosts.push_back(
        {.name = "a\"b\\c\nd\x01", .state = "late", .lastShown = FrameNumber(7), .roundTripMs = 0.5});
    status.waits.push_back({.tile = "front 0,0", .host = "größe", .frames = 3, .ms = 12, .reason = "draw"});
    const std::string text = metricsText(status);
    EXPECT_TRUE(text.ends_with("# EOF\n"));
    EXPECT_NE(text.find("tessera_host_shown_frame{host=\"a\\\"b\\\\c\\nd\"} 7\n"), std::string::npos) << text;
    EXPECT_NE(text.find("tessera_tile_waited_seconds{tile=\"front 0,0\",host=\"größe\",reason=\"draw\"} 0.012\n"),
              std::string::npos)
        << text;
    EXPECT_NE(text.find("# TYPE tessera_frames counter\n"), std::string::npos);
    EXPECT_NE(text.find("\ntessera_frames_total 0\n"), std::string::npos);
}

TEST(RatesOfStrangers, AreOfEachAddress) {
    RatesOfStrangers rates(10, 20);
    const auto now = std::chrono::steady_clock::now();
    while (rates.take(SourceAddress(1), now)) {
    }
    EXPECT_TRUE(rates.take(SourceAddress(2), now)) << "who floods keeps nobody else from the page";
    EXPECT_FALSE(rates.take(SourceAddress(1), now));
}

TEST(RatesOfPeople, AreOfEachAndNobodyHasMoreByComingFromManyAddresses) {
    RatesOfPeople rates(10, 20);
    std::chrono::steady_clock::time_point now{};
    const auto granted = [&](const std::string& name, int times, bool elsewhere = false) {
        int count = 0;
        for (int i = 0; i < times; ++i) {
            const std::string from = fmt::format("10.0.0.{}", elsewhere ? i % 250 : 1);
            count += rates.take({.role = Role::kEditor, .by = Entrant::By::kPass, .name = name, .from = from}, now);
        }
        return count;
    };
    EXPECT_EQ(granted("ada", 1'000, true), 20);
    EXPECT_EQ(granted("ben", 15), 15) << "what ada asks is none of his";
    now += std::chrono::seconds(1);
    EXPECT_EQ(granted("ada", 1'000), 10);
    for (std::size_t i = 0; i < 3 * RatesOfPeople::kMost; ++i) {
        ASSERT_EQ(granted(fmt::format("guest {}", i), 1), 1);
        ASSERT_EQ(granted("ada", 1), 0) << "whoever goes on asking is not forgotten: " << i;
    }
}

}  // namespace
}  // namespace tessera
