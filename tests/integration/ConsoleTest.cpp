/// The console of a running wall: requests of another language, and all that may come to a port.
#include <gtest/gtest.h>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <memory>
#include <set>
#include <thread>

#include "tests/integration/DoorClient.h"
#include "tests/integration/ThreadWall.h"

namespace tessera::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

/// A wall of one host, its console's port and token.
struct ConsoleWall {
    ConsoleWall() : wall({.wall = "1x1", .size = "64x36"}) {
        wall.startClient("all");
        const std::string link = wall.server().waitForText("console: http://127.0.0.1:", 20s).value_or("0/?token=");
        port = static_cast<std::uint16_t>(std::stoi(link));
        token = link.substr(link.find("?token=") + 7);
        bearer = "Authorization: Bearer " + token + "\r\n";
    }
    ThreadWall wall;
    std::uint16_t port = 0;
    std::string token, bearer;
};

/// Requests to a console, as its tests say them.
class ConsoleTest : public testing::Test {
protected:
    explicit ConsoleTest(ConsoleWall& console)
        : wall_(console.wall), port_(console.port), token_(console.token), bearer_(console.bearer) {}
    [[nodiscard]] std::string socketTarget(const std::string& more = {}) const {
        return "/socket?token=" + token_ + more;
    }
    [[nodiscard]] HttpReply get(const std::string& target) const { return http(port_, "GET", target, bearer_); }
    [[nodiscard]] HttpReply post(const std::string& request, const std::string& body) const {
        return http(port_, "POST", "/api/" + request, bearer_, body);
    }
    [[nodiscard]] static std::string codeOf(const HttpReply& reply) {
        const json body = json::parse(reply.body, nullptr, false);
        return body.is_object() && body.contains("error") ? body["error"].value("code", "") : "";
    }

    ThreadWall& wall_;
    const std::uint16_t port_;
    const std::string token_, bearer_;
};

/// All of them say it to the same one.
class Console : public ConsoleTest {
protected:
    Console() : ConsoleTest(*console_) {}
    static void SetUpTestSuite() { console_ = std::make_unique<ConsoleWall>(); }
    static void TearDownTestSuite() { console_.reset(); }

private:
    static inline std::unique_ptr<ConsoleWall> console_;
};

/// Each has its own, which is crowded or ends.
class CrowdedConsole : private ConsoleWall, public ConsoleTest {
protected:
    CrowdedConsole() : ConsoleTest(static_cast<ConsoleWall&>(*this)) {}
};

TEST_F(Console, TellsAllThatCanBeAskedAndAllTypes) {
    const HttpReply reply = get("/api");
    ASSERT_EQ(reply.status, 200) << reply.head << wall_.logs();
    const json api = json::parse(reply.body);
    EXPECT_EQ(api["api"], 1);
    EXPECT_GE(api["requests"].size(), 15u);
    EXPECT_GE(api["types"].size(), 30u);
    for (const json& request : api["requests"]) {
        EXPECT_TRUE(request.contains("role") && request.contains("help")) << request;
        // Each is known at the door: whatever is wrong with saying nothing, it is not the name.
        const HttpReply said = post(request["name"], "{}");
        const json answer = json::parse(said.body, nullptr, false);
        ASSERT_TRUE(answer.is_object()) << request["name"] << said.head << said.body;
        if (answer.contains("error"))
            EXPECT_EQ(answer["error"]["message"].get<std::string>().find("there is no request"), std::string::npos)
                << answer;
    }
    // What a page is shown with.
    for (const std::string field : {"Content-Security-Policy: default-src 'none'", "Referrer-Policy: no-referrer",
                                    "X-Content-Type-Options: nosniff", "Cache-Control: no-store"})
        EXPECT_NE(reply.head.find(field), std::string::npos) << reply.head;
    EXPECT_EQ(reply.head.find("Set-Cookie"), std::string::npos);
    EXPECT_EQ(reply.head.find("unsafe"), std::string::npos);
}

TEST_F(Console, MovesANodeByItsPathAndTellsEverybody) {
    DoorSocket watcher(port_, socketTarget("&changes=1"));
    ASSERT_TRUE(watcher.open()) << watcher.refused();
    const json whole = watcher.next();
    ASSERT_TRUE(whole["changes"]["whole"]) << whole;

    DoorSocket mover(port_, socketTarget());
    const json tree = mover.ask(1, "FindNodes", {{"expression", "//*[Transform]"}});
    ASSERT_EQ(tree["answer"], "FoundPage") << tree;
    ASSERT_FALSE(tree["fields"]["nodes"].empty());
    const json node = tree["fields"]["nodes"][0];
    const json moved = mover.ask(2, "MoveNode", {{"node", node["path"]}, {"translation", {0.5, 0.25, -1}}});
    ASSERT_EQ(moved["answer"], "Committed") << moved;

    bool told = false;
    for (int i = 0; i < 200 && !told; ++i) {
        const json said = watcher.next();
        ASSERT_FALSE(said.is_null());
        if (!said.contains("changes") || !said["changes"].contains("list")) continue;
        for (const json& column : said["changes"]["list"].value("set", json::array()))
            told = told || (column["type"] == "Transform" && column["field"] == "translation" &&
                            column["values"][0] == json({0.5, 0.25, -1}));
    }
    EXPECT_TRUE(told);
    const json object = mover.ask(3, "GetObjects", {{"names", {node["path"]}}, {"content", true}});
    EXPECT_NE(object["fields"]["content"].dump().find("[0.5,0.25,-1.0]"), std::string::npos) << object;
    EXPECT_EQ(mover.ask(4, "UndoStep")["answer"], "Committed");
}

TEST_F(Console, BuildsAndPaintsWithBinaries) {
    DoorSocket socket(port_, socketTarget());
    // Three corners of a triangle, and their numbers.
    const float corners[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    const std::uint32_t indices[3] = {0, 1, 2};
    const json list = {
        {"created", {{{"id", "$0"}, {"type", "Node"}}, {{"id", "$1"}, {"type", "Geometry"}}}},
        {"placed", {{{"node", "$0"}, {"parent", 1}}}},
        {"set",
         {{{"type", "Node"}, {"field", "name"}, {"ids", {"$0"}}, {"values", {"made"}}},
          {{"type", "Node"}, {"field", "core"}, {"ids", {"$0"}}, {"values", {"$1"}}},
          {{"type", "Geometry"}, {"field", "positions"}, {"ids", {"$1"}}, {"values", {{{"binary", 0}}}}},
          {{"type", "Geometry"}, {"field", "indices"}, {"ids", {"$1"}}, {"values", {{{"binary", 1}}}}}}}};
    ASSERT_TRUE(socket.sendText(
        json{{"id", 1}, {"request", "ProposeChanges"}, {"fields", {{"list", list}}}, {"binaries", 2}}.dump()));
    ASSERT_TRUE(socket.sendBinary({reinterpret_cast<const char*>(corners), sizeof corners}));
    ASSERT_TRUE(socket.sendBinary({reinterpret_cast<const char*>(indices), sizeof indices}));
    const json committed = socket.answerTo(1);
    ASSERT_EQ(committed["answer"], "Committed") << committed;
    ASSERT_EQ(committed["fields"]["ids"].size(), 2u) << committed;
    EXPECT_EQ(committed["fields"]["ids"][0]["placeholder"], "$0");
    EXPECT_NE(wall_.ctl({"tree"}).output.find("made"), std::string::npos);
    const json removed = socket.ask(2, "RemoveNode", {{"node", "/made"}});
    EXPECT_EQ(removed["answer"], "Committed") << removed;
}

TEST_F(CrowdedConsole, TellsOfFramesAndEndsWithTheServer) {
    DoorSocket socket(port_, socketTarget());
    ASSERT_EQ(socket.ask(1, "SubscribeNews", {{"frames", true}})["answer"], "Done");
    std::int64_t last = -1;
    for (int i = 0; i < 5; ++i) {
        const json said = socket.next();
        ASSERT_EQ(said["notice"], "Frame") << said;
        EXPECT_GT(said["fields"]["frame"].get<std::int64_t>(), last);
        last = said["fields"]["frame"];
    }
    (void)wall_.finish();
    while (!socket.next().is_null()) {
    }
    EXPECT_FALSE(socket.open());
}

TEST_F(Console, LetsNobodyElseIn) {
    EXPECT_EQ(http(port_, "GET", "/api", "").status, 401);
    EXPECT_EQ(http(port_, "GET", "/api", "Authorization: Bearer wrong\r\n").status, 401);
    EXPECT_EQ(http(port_, "GET", "/api", bearer_ + "Origin: http://evil.example\r\n").status, 403);
    EXPECT_EQ(http(port_, "GET", "/api", bearer_ + "Host: evil.example:" + std::to_string(port_) + "\r\n").status, 421);
    const HttpReply page = http(port_, "GET", "/", "");
    EXPECT_EQ(page.status, 401);
    EXPECT_NE(page.body.find("<form"), std::string::npos);
    EXPECT_EQ(http(port_, "GET", "/style.css", "").status, 200);
    EXPECT_EQ(http(port_, "GET", "/page/main.js", "").status, 200);
    EXPECT_EQ(http(port_, "GET", "/page/main.js", "Host: evil.example:" + std::to_string(port_) + "\r\n").status, 421);
    EXPECT_EQ(http(port_, "GET", "/page/index.html", "").status, 404);
    EXPECT_EQ(http(port_, "GET", "/api.html", "").status, 401);
    EXPECT_EQ(http(port_, "GET", "/?token=" + token_, "").status, 200);
    EXPECT_EQ(http(port_, "GET", "/api.html?token=" + token_, "").status, 200);
    EXPECT_TRUE(DoorSocket(port_, "/socket").refused().starts_with("HTTP/1.1 401"));
    EXPECT_TRUE(
        DoorSocket(port_, socketTarget(), "Origin: http://evil.example\r\n").refused().starts_with("HTTP/1.1 403"));
    EXPECT_TRUE(DoorSocket(port_, socketTarget(), "Origin: http://127.0.0.1:" + std::to_string(port_) + "\r\n").open());
    // The token is in the one line that prints the link.
    const std::string output = wall_.server().output();
    EXPECT_EQ(output.find(token_), output.rfind(token_));
}

TEST_F(Console, AnswersRubbishInWordsAndGoesOn) {
    EXPECT_EQ(get("/nothing").status, 404);
    EXPECT_EQ(post("", "{}").status, 404);
    const HttpReply put = http(port_, "PUT", "/api", bearer_);
    EXPECT_EQ(put.status, 405);
    EXPECT_NE(put.head.find("Allow: GET"), std::string::npos);
    EXPECT_EQ(codeOf(post("GetEverything", "{}")), "not_found");
    EXPECT_EQ(codeOf(post("MoveNode", "{\"node\":\"/nowhere\"}")), "not_found");
    EXPECT_EQ(codeOf(post("MoveNode", "[[[")), "bad_input");
    EXPECT_EQ(codeOf(post("MoveNode", std::string(1 << 20, '['))), "limit");
    EXPECT_EQ(post("MoveNode", std::string(5 << 20, ' ')).status, 413);
    EXPECT_EQ(http(port_, "GET", "/api", bearer_ + "X: " + std::string(20'000, 'x') + "\r\n").status, 431);
    EXPECT_TRUE(sayRaw(port_, "rubbish\r\n\r\n").starts_with("HTTP/1.1 400"));
    EXPECT_EQ(sayRaw(port_, std::string("\x16\x03\x01\x02\x00\x01", 6)).find("HTTP/1.1 200"),
              std::string::npos);  // TLS
    const std::string host = "Host: 127.0.0.1:" + std::to_string(port_) + "\r\n";
    const std::string inChunks = host + "Transfer-Encoding: chunked\r\n\r\n";
    const std::string chunked = "POST /api/GetStatus HTTP/1.1\r\n" + bearer_ + inChunks;
    EXPECT_TRUE(sayRaw(port_, chunked + "zz\r\n{}\r\n").starts_with("HTTP/1.1 411"));
    // Of a trailer of 100 kB the server died, without a token.
    const std::string trailer = "0\r\nX: " + std::string(100'000, 'x') + "\r\n\r\n";
    EXPECT_TRUE(sayRaw(port_, "GET /style.css HTTP/1.1\r\n" + inChunks + trailer).starts_with("HTTP/1.1 411"));
    const std::string asked = "GET /api HTTP/1.1\r\n" + host + bearer_;
    for (const std::string& twice : {host, bearer_, std::string("Origin: http://evil.example\r\nOrigin: null\r\n")})
        EXPECT_TRUE(sayRaw(port_, asked + twice + "\r\n").starts_with("HTTP/1.1 400")) << twice;
    // A handshake that is none is refused as everything else is.
    const std::string upgrade =
        "GET /socket HTTP/1.1\r\n" + host + bearer_ + "Connection: Upgrade\r\nUpgrade: websocket\r\n";
    const std::string key = "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
    const std::string older = sayRaw(port_, upgrade + key + "Sec-WebSocket-Version: 8\r\n\r\n");
    EXPECT_TRUE(older.starts_with("HTTP/1.1 426")) << older;
    EXPECT_NE(older.find("Sec-WebSocket-Version: 13\r\n"), std::string::npos) << older;
    EXPECT_NE(older.find("\"code\":\"unsupported\""), std::string::npos) << older;
    const std::string shortKey = "Sec-WebSocket-Key: short\r\nSec-WebSocket-Version: 13\r\n\r\n";
    EXPECT_TRUE(sayRaw(port_, upgrade + shortKey).starts_with("HTTP/1.1 400"));
    // Behind HTTP many share one link: what one subscribes to would come to all, and to nobody.
    const HttpReply subscribed = post("SubscribeNews", R"({"frames":true})");
    EXPECT_EQ(subscribed.status, 406);
    EXPECT_NE(subscribed.body.find("ask it at /socket"), std::string::npos) << subscribed.body;
    const json wrong = json::parse(post("MoveNode", R"({"node":1,"translation":[1,"2",3]})").body);
    EXPECT_EQ(wrong["error"]["field"], "translation[1]") << wrong;

    DoorSocket socket(port_, socketTarget());
    ASSERT_TRUE(socket.sendText("{\"id\":1,"));
    EXPECT_EQ(socket.next()["error"]["code"], "bad_input");
    EXPECT_EQ(socket.ask(2, "MoveNode", {{"nod", 1}})["error"]["field"], "nod");
    EXPECT_EQ(socket.ask(3, "GetStatus")["answer"], "Status");
    ASSERT_TRUE(socket.sendBinary("what is this"));
    EXPECT_TRUE(socket.next().is_null());
    EXPECT_EQ(socket.closeCode(), 1002) << socket.closeReason();
    DoorSocket another(port_, socketTarget());
    ASSERT_TRUE(another.sendText(std::string(5 << 20, ' ')));
    EXPECT_TRUE(another.next().is_null());
    EXPECT_EQ(another.closeCode(), 1009);
    EXPECT_EQ(get("/api").status, 200);
}

TEST_F(Console, AHeadThatDoesNotComeIsAnsweredInWords) {
    EXPECT_TRUE(sayRaw(port_, "GET /api HTTP/1.1\r\nHost: ").starts_with("HTTP/1.1 408"));
}

TEST_F(CrowdedConsole, TooMuchAtOnceIsRefusedInWordsAndNoFrameIsLate) {
    std::size_t refused = 0;
    std::string all;
    for (int i = 0; i < 600; ++i)
        all += "GET /style.css HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port_) + "\r\n\r\n";
    all += "GET /style.css HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port_) + "\r\nConnection: close\r\n\r\n";
    const std::string answers = sayRaw(port_, all);
    for (std::size_t at = 0; (at = answers.find("HTTP/1.1 429", at)) != std::string::npos; ++at) ++refused;
    EXPECT_GT(refused, 0u);
    EXPECT_NE(answers.find("Retry-After: 1"), std::string::npos);
    // More sockets than may be open.
    std::vector<std::unique_ptr<DoorSocket>> sockets;
    for (int i = 0; i < 70; ++i) sockets.push_back(std::make_unique<DoorSocket>(port_, socketTarget()));
    EXPECT_EQ(std::ranges::count_if(sockets, [](const auto& socket) { return socket->open(); }), 48);
    EXPECT_NE(sockets.back()->refused().find("as many sockets are open as may be"), std::string::npos)
        << sockets.back()->refused();
    sockets.clear();
    EXPECT_EQ(get("/metrics").status, 200);
}

TEST_F(Console, ShowsTheWallAndItsTiles) {
    ASSERT_TRUE(wall_.waitForFrame("front-0-0", 1, 30s)) << wall_.logs();
    HttpReply png = get("/tile/front-0-0.png");
    ASSERT_EQ(png.status, 200) << png.body << wall_.logs();
    EXPECT_TRUE(png.body.starts_with("\x89PNG"));
    const HttpReply jpeg = get("/wall.jpg");
    ASSERT_EQ(jpeg.status, 200) << jpeg.body;
    EXPECT_TRUE(jpeg.body.starts_with("\xff\xd8\xff")) << jpeg.head;
    EXPECT_NE(jpeg.head.find("image/jpeg"), std::string::npos);
    EXPECT_EQ(codeOf(get("/tile/front-7-0.png")), "not_found");
}

TEST_F(Console, FiguresEndAsTheFormatSays) {
    const HttpReply figures = get("/metrics");
    ASSERT_EQ(figures.status, 200);
    EXPECT_NE(figures.head.find("application/openmetrics-text"), std::string::npos);
    EXPECT_NE(figures.body.find("tessera_host_up{host=\"all\""), std::string::npos) << figures.body;
    EXPECT_TRUE(figures.body.ends_with("# EOF\n"));
}

/// While as much is open as may be nothing is read, and the session goes on all the same.
TEST_F(Console, AThousandRequestsAtOnceAreAllAnswered) {
    DoorSocket socket(port_, socketTarget());
    constexpr int kMany = 1000;
    for (int id = 0; id < kMany; ++id) ASSERT_TRUE(socket.sendText(json{{"id", id}, {"request", "GetStatus"}}.dump()));
    std::set<int> answered;
    while (answered.size() < kMany) {
        const json said = socket.next();
        ASSERT_TRUE(said.is_object()) << answered.size() << " were answered";
        if (said.contains("answer")) answered.insert(said["id"].get<int>());
    }
    EXPECT_EQ(*answered.rbegin(), kMany - 1);
}

/// Who has no token may look at the style, and keeps nobody out who has one.
TEST_F(CrowdedConsole, ThoseWithoutATokenGiveWay) {
    std::vector<int> kept;
    for (int i = 0; i < 300; ++i) {
        const int one = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
        sockaddr_in to{};
        to.sin_family = AF_INET;
        to.sin_port = htons(port_);
        to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        ASSERT_EQ(::connect(one, reinterpret_cast<const sockaddr*>(&to), sizeof to), 0);
        const std::string asks = "GET /style.css HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port_) + "\r\n\r\n";
        ASSERT_EQ(::send(one, asks.data(), asks.size(), MSG_NOSIGNAL), static_cast<ssize_t>(asks.size()));
        kept.push_back(one);
    }
    for (int i = 0; i < 20; ++i) EXPECT_EQ(get("/api").status, 200) << i;
    DoorSocket socket(port_, socketTarget());
    EXPECT_TRUE(socket.open()) << socket.refused();
    for (const int one : kept) ::close(one);
}

}  // namespace
}  // namespace tessera::test
