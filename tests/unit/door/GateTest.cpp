/// Who is let in, what a target says, what a message on a socket is.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "server/door/Envelope.h"
#include "server/door/Gatekeeper.h"
#include "server/door/Metrics.h"

namespace tessera {
namespace {

int verdict(HttpRequest request) {
    const Gatekeeper gate({{"looks", "changes", "secret"}}, 7001);
    const std::optional<HttpTarget> target = readTarget(request.target);
    if (!target) return 400;
    const tl::expected<Role, HttpAnswer> role = gate.roleOf(request, *target);
    return role ? 200 : role.error().status;
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
    EXPECT_EQ(verdict({.target = "/api", .host = "127.0.0.1:7001", .origin = "HTTP://LOCALHOST:7001", .authorization = bearer}),
              200);
    EXPECT_EQ(verdict({.target = "/?token=secret", .host = "localhost:7001"}), 200);
    EXPECT_EQ(verdict({.target = "/socket?changes=1&token=secret", .host = "localhost:7001"}), 200);
}

TEST(Gatekeeper, TellsRolesByTheirTokens) {
    const Gatekeeper gate({{"looks", "changes", "secret"}}, 7001);
    const auto roleOf = [&](const std::string& token) {
        const HttpRequest request{.target = "/api", .host = "localhost:7001", .authorization = "Bearer " + token};
        return gate.roleOf(request, *readTarget("/api")).value();
    };
    EXPECT_EQ(roleOf("looks"), Role::kViewer);
    EXPECT_EQ(roleOf("changes"), Role::kEditor);
    EXPECT_EQ(roleOf("secret"), Role::kOperator);
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

}  // namespace
}  // namespace tessera
