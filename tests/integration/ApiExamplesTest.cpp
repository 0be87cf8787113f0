/// Every example of the API's page, said to a running wall; and who may say what through which door.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include "common/access/LocalWalls.h"
#include "common/application/Application.h"
#include "common/request/Catalogue.h"
#include "tests/integration/DoorClient.h"
#include "tests/integration/ThreadWall.h"
#include "tests/unit/Eventually.h"

namespace tessera::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

struct AllowedWall {
    AllowedWall()
        : wall({.wall = "1x1",
                .scene = std::string(TESSERA_SOURCE_DIR) + "/tests/data/scenes/api.tsct",
                .size = "160x90",
                .server = {"--allow", models.path(), "--assets", models.path()}}) {
        models.write("box.tsct", "node { name: \"box\" box { size { x: 1 y: 1 z: 1 } } }\n");
        wall.startClient("all");
    }
    TemporaryFolder models;
    ThreadWall wall;
};

/// The tests of a suite ask the same one.
class ApiWall : public testing::Test {
protected:
    ApiWall() {
        const std::string link = linkOf("operator"), at = link.substr(0, link.find("/?"));
        port_ = static_cast<std::uint16_t>(std::stoi(at.substr(at.rfind(':') + 1)));
    }
    static void SetUpTestSuite() { started_ = std::make_unique<AllowedWall>(); }
    static void TearDownTestSuite() { started_.reset(); }
    std::string linkOf(const std::string& role) {
        return json::parse(wall_.ctl({"--json", "link", "--role", role}).output, nullptr, false)
            .value("link", "0:0/?token=");
    }
    std::string tokenOf(const std::string& role) {
        const std::string link = linkOf(role);
        return link.substr(link.find("token=") + 6);
    }

    const TemporaryFolder& models_ = started_->models;
    ThreadWall& wall_ = started_->wall;
    std::uint16_t port_ = 0;

private:
    static inline std::unique_ptr<AllowedWall> started_;
};

/// Its wall is its own: the examples are done to it.
class ApiPage : public ApiWall {};

TEST_F(ApiPage, EachExampleOfThePageIsGranted) {
    ASSERT_TRUE(wall_.waitForFrame("front-0-0", 3, 60s)) << wall_.logs();
    DoorSocket socket(port_, "/socket?token=" + tokenOf("operator"));
    ASSERT_TRUE(socket.open()) << socket.refused();
    const HttpReply page = http(port_, "GET", "/api.html?token=" + tokenOf("operator"), "");
    const json api =
        json::parse(http(port_, "GET", "/api", "Authorization: Bearer " + tokenOf("operator") + "\r\n").body);
    int asked = 1000;
    EXPECT_TRUE(eventually([&] { return !socket.ask(asked++, "GetQuestions")["fields"]["questions"].empty(); }));
    int id = 0, said = 0;
    for (const json& request : api["requests"]) {
        const std::string name = request["name"];
        // As the page has it, in its letters.
        const std::string begins = "<pre>{\"id\":1,\"request\":\"" + name + "\",\"fields\":";
        const std::size_t at = page.body.find(begins);
        ASSERT_NE(at, std::string::npos) << name;
        std::string text = page.body.substr(at + begins.size(), page.body.find("}</pre>", at) - at - begins.size());
        for (std::size_t quote = 0; (quote = text.find("&quot;")) != std::string::npos;) text.replace(quote, 6, "\"");
        const json fields = json::parse(text, nullptr, false);
        ASSERT_EQ(fields, request["example"]) << name << " on the page: " << text;
        if (text.find("/srv/models") != std::string::npos) text.replace(text.find("/srv/models"), 11, models_.path());
        // What one was taken back can be done again: after another edit there is nothing.
        if (name == "RedoStep") EXPECT_EQ(socket.ask(++id, "UndoStep")["answer"], "Committed");
        const json answer = socket.ask(++id, name, json::parse(text));
        ASSERT_TRUE(answer.is_object()) << name << wall_.logs();
        // An operator's token is of no panel: whose is, python.panel asks.
        if (name == "GetPanel") {
            EXPECT_NE(answer.dump().find("this link is of no panel"), std::string::npos) << answer;
            continue;
        }
        // No file is on its way here: python.loads cancels some.
        if (name == "CancelLoad") {
            EXPECT_NE(answer.dump().find("no load 7 is on its way"), std::string::npos) << answer;
            continue;
        }
        EXPECT_FALSE(answer.contains("error")) << name << " " << text << ": " << answer;
        EXPECT_EQ(answer["answer"], request["answer"]) << name;
        // Those that pick have something to find.
        if (answer["fields"].contains("hit")) EXPECT_TRUE(answer["fields"]["hit"]) << name << answer;
        for (int binary = 0; binary < answer.value("binaries", 0); ++binary) (void)socket.nextBinary();
        ++said;
    }
    EXPECT_GE(said, 31);
}

/// Through all doors alike: the native link, HTTP, a socket.
TEST_F(ApiWall, EachRoleMaySayItsRequestsThroughEachDoorAndNoOthers) {
    // With pictures to be had, whose bytes come behind an answer.
    ASSERT_TRUE(wall_.waitForFrame("front-0-0", 3, 60s)) << wall_.logs();
    std::size_t looked = 0;
    for (const Role role : {Role::kViewer, Role::kEditor, Role::kOperator}) {
        const std::string token = tokenOf(std::string(nameOf(role)));
        const std::string bearer = "Authorization: Bearer " + token + "\r\n";
        DoorSocket socket(port_, "/socket?token=" + token);
        ASSERT_TRUE(socket.open()) << socket.refused();
        const Outcome who = wall_.ctl({"--token-file", models_.write("token", token + "\n"), "--json", "whoami"});
        EXPECT_EQ(json::parse(who.output, nullptr, false).value("role", ""), nameOf(role)) << who.output;
        auto native = Application::connect({.address = wall_.address(),
                                            .name = "table",
                                            .tokenFile = models_.path() + "/token",
                                            .followScene = false});
        ASSERT_TRUE(native) << native.error().message;
        int id = 0;
        for (const RequestText& request : allRequests()) {
            const bool may = role >= request.info.role;
            const std::string words =
                fmt::format("{} is for an {}; this link is of a", request.info.name, nameOf(request.info.role));
            const auto isRefused = [&](const json& answer) {
                return answer.contains("error") && answer["error"].value("message", "").find(words) == 0;
            };
            // Fields that are wrong are refused later than the role, and stay without a deed.
            const json none = json::parse(request.info.example);
            EXPECT_EQ(isRefused(socket.ask(++id, std::string(request.info.name), none)), !may)
                << request.info.name << nameOf(role) << " at a socket";
            const HttpReply said = http(port_, "POST", fmt::format("/api/{}", request.info.name), bearer, none.dump());
            EXPECT_EQ(isRefused(json::parse(said.body, nullptr, false)), !may)
                << request.info.name << nameOf(role) << " over HTTP: " << said.body;
            EXPECT_EQ(said.status == 403, !may) << request.info.name << said.status;
            ++looked;
        }
        // The native link: what the library can say of each role's.
        EXPECT_TRUE((*native)->status());
        const auto undone = (*native)->undo();
        EXPECT_EQ(!undone && undone.error().message.find("UndoStep is for an editor") != std::string::npos,
                  role < Role::kEditor);
        const auto budget = (*native)->setBudget(0);
        EXPECT_EQ(!budget && budget.error().message.find("SetBudget is for an operator") != std::string::npos,
                  role < Role::kOperator);
    }
    EXPECT_EQ(looked, 3 * allRequests().size());
}

TEST_F(ApiWall, AnotherUserOfThisMachineIsRefusedInWords) {
    // Whose run folder is another one has no token, as other users have none.
    const TemporaryFolder elsewhere;
    const auto asOther = [&](std::vector<std::string> command) {
        command.insert(command.begin(), {"/usr/bin/env", "XDG_RUNTIME_DIR=" + elsewhere.path()});
        return run(elsewhere.path(), command, 20s);
    };
    const Outcome asks = asOther({program("tessera-ctl"), "--server", wall_.address(), "status"});
    EXPECT_NE(asks.exitCode, 0);
    EXPECT_NE(asks.output.find("takes programs of its own user"), std::string::npos) << asks.output;
    const Outcome host = asOther({program("tessera-client"), "--server", wall_.address(), "--host", "all"});
    EXPECT_NE(host.exitCode, 0) << "it does not try again";
    EXPECT_NE(host.output.find("--token-file"), std::string::npos) << host.output;
    const Outcome guessed = asOther({program("tessera-ctl"), "--server", wall_.address(), "--token-file",
                                     elsewhere.write("t", std::string(43, 'x') + "\n"), "status"});
    EXPECT_NE(guessed.output.find("not this server's"), std::string::npos) << guessed.output;
    const Outcome told =
        asOther({program("tessera-ctl"), "--server", wall_.address(), "--token-file", wall_.tokenFile(), "whoami"});
    EXPECT_EQ(told.exitCode, 0) << told.output;
    EXPECT_NE(told.output.find("operator"), std::string::npos);
    // A visitor may look, and nothing else; a host it is not.
    const std::string viewer = elsewhere.write("viewer", tokenOf("viewer") + "\n");
    EXPECT_EQ(asOther({program("tessera-ctl"), "--server", wall_.address(), "--token-file", viewer, "tree"}).exitCode,
              0);
    const Outcome removes =
        asOther({program("tessera-ctl"), "--server", wall_.address(), "--token-file", viewer, "remove", "/hall"});
    EXPECT_NE(removes.output.find("RemoveNode is for an editor; this link is of a viewer"), std::string::npos)
        << removes.output;
    const Outcome draws =
        asOther({program("tessera-client"), "--server", wall_.address(), "--host", "all", "--token-file", viewer});
    EXPECT_NE(draws.output.find("needs the token of an operator"), std::string::npos) << draws.output;
}

}  // namespace
}  // namespace tessera::test
