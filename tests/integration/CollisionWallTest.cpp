/// A person pushes an engine through the hall, on a wall of real processes: it stops where it touches, everybody is
/// told, and the picture shows it.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "client/image/Picture.h"
#include "tests/integration/LiveWall.h"

namespace tessera::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

constexpr const char* kModels = "/usr/share/assimp/models";

// From deploy/scenes/engine-hall.tsct, along x: the trolley's buffers reach 0.95 + 0.04 ahead of it; the braces of the
// crates in its way begin at 3.1 - 0.528 - 0.02.
constexpr double kTrolleyAtTheCrates = (3.1 - 0.528 - 0.02) - (0.95 + 0.04);
// How far from the obstacle a motion may end: 1e-4 sizes of the moving geometry, none of which is 3 m large.
constexpr double kStopTolerance = 3e-4;

/// The hall on a wall, its crane stopped and the onlooker's walk not followed, so that pictures change by the trolley
/// alone.
class Hall {
public:
    explicit Hall(const std::string& wallName)
        : wall_({.wall = patient(wallName),
                 .scene = std::string(TESSERA_SOURCE_DIR) + "/deploy/scenes/engine-hall.tsct",
                 .size = "320x180",
                 .server = {"--assets", kModels}}) {
        if (wall_.address().empty()) return;
        const std::vector<std::string> hosts = wallName == "1x1" ? std::vector<std::string>{"all"} : kFourHosts;
        for (const std::string& host : hosts) wall_.startClient(host);
        ready_ = wall_.waitForFrame("front-0-0", 2, 100s);
        (void)ask({"move", "/hall/crane", "0.1", "0", "0"});
        (void)ask({"view", "--position", "-7.5", "0.5", "2.2", "--look-at", "2", "0", "-0.2"});
    }
    [[nodiscard]] bool ready() const { return ready_; }
    [[nodiscard]] std::string logs() const { return wall_.logs(); }

    /// Runs a verb with --json and parses what it says.
    json ask(std::vector<std::string> words) const {
        words.insert(words.begin(), "--json");
        const Outcome outcome = wall_.ctl(words);
        EXPECT_EQ(outcome.exitCode, 0) << words[1] << ": " << outcome.output;
        const json answer = json::parse(outcome.output, nullptr, false);
        EXPECT_FALSE(answer.is_discarded()) << outcome.output;
        return answer;
    }
    /// Moves the trolley; where it is then.
    struct Moved {
        bool stopped = false;
        double x = 0, z = 0;
    };
    Moved moveTrolley(const std::string& x, const std::string& z, bool by = false) const {
        std::vector<std::string> words = {"move", "/hall/trolley", x, "0", z};
        if (by) words.emplace_back("--by");
        const json answer = ask(words);
        if (!answer.is_object() || !answer.contains("translation")) return {};
        return {!answer["stopped"].empty(), answer["translation"][0], answer["translation"][2]};
    }
    [[nodiscard]] json contacts() const { return ask({"contacts"})["contacts"]; }
    /// As the wall is once everything that the present contacts lead to is drawn.
    [[nodiscard]] Picture picture(const std::string& name) const {
        const json told = ask({"contacts"});
        EXPECT_TRUE(wall_.waitForFrame("front-0-0", told["frame"].get<std::int64_t>() + 3, 60s)) << logs();
        const std::string path = wall_.folder() + "/" + name + ".png";
        EXPECT_EQ(wall_.ctl({"snapshot", path}).exitCode, 0);
        const Expected<Bytes> bytes = readFile(path, 64 << 20);
        if (!bytes) return {};
        const Expected<DecodedPng> png = decodePng(*bytes);
        return png ? png->picture : Picture{};
    }
    [[nodiscard]] json finish() { return wall_.finish(); }

private:
    /// A shipped wall with a patience that a loaded machine does not try.
    std::string patient(const std::string& name) const {
        const std::string text = readText(std::string(TESSERA_SOURCE_DIR) + "/deploy/walls/" + name + ".wall");
        return folder_.write(name + ".wall", text.substr(0, text.find("sync {")) + "sync { lost_after_ms: 8000 }\n");
    }

    TemporaryFolder folder_;
    LiveWall wall_;
    bool ready_ = false;
};

bool engineIsMissing() {
    return !std::filesystem::exists(std::string(kModels) + "/glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb");
}

/// Whether one of the two paths begins with each of these.
bool between(const json& contact, const std::string& a, const std::string& b) {
    const auto begins = [&](int side, const std::string& path) {
        return contact["objects"][static_cast<std::size_t>(side)].get<std::string>().rfind(path, 0) == 0;
    };
    return (begins(0, a) && begins(1, b)) || (begins(0, b) && begins(1, a));
}

std::size_t pixelsThatDiffer(const Picture& a, const Picture& b) {
    std::size_t count = 0;
    for (std::size_t i = 0; i + 2 < a.rgb.size() && i + 2 < b.rgb.size(); i += 3)
        count += !std::equal(a.rgb.begin() + static_cast<std::ptrdiff_t>(i),
                             a.rgb.begin() + static_cast<std::ptrdiff_t>(i + 3),
                             b.rgb.begin() + static_cast<std::ptrdiff_t>(i));
    return count;
}

TEST(CollisionWall, APushedEngineStopsWhereItTouchesAndTheWallShowsIt) {
    if (engineIsMissing()) GTEST_SKIP() << "the engine is missing (Debian package assimp-testmodels)";
    Hall::Moved pushed;
    Picture touching;
    {
        Hall hall("2x2");
        ASSERT_TRUE(hall.ready()) << hall.logs();
        const Picture before = hall.picture("before");
        ASSERT_EQ(before.widthPx, 320);
        EXPECT_TRUE(hall.contacts().empty());

        pushed = hall.moveTrolley("12", "0", true);
        EXPECT_TRUE(pushed.stopped);
        EXPECT_LE(pushed.x, kTrolleyAtTheCrates + 1e-7) << "not into the crates";
        EXPECT_GE(pushed.x, kTrolleyAtTheCrates - kStopTolerance) << "up to the crates";
        EXPECT_EQ(pushed.z, 0.15);
        const json contacts = hall.contacts();
        ASSERT_FALSE(contacts.empty());
        for (const json& contact : contacts) {
            EXPECT_TRUE(between(contact, "/hall/trolley/cart/buffer", "/hall/crates/stack/crate")) << contact.dump(2);
            EXPECT_NEAR(contact["point"][0].get<double>(), 3.1 - 0.528 - 0.02, 2 * kStopTolerance) << contact.dump(2);
        }
        touching = hall.picture("touching");
        EXPECT_GT(pixelsThatDiffer(before, touching), 320u * 180u / 50) << "the trolley is elsewhere";

        // Who pushes on gets no further.
        for (int push = 0; push < 3; ++push) {
            const Hall::Moved again = hall.moveTrolley("0.4", "0", true);
            EXPECT_TRUE(again.stopped);
            EXPECT_LE(again.x, kTrolleyAtTheCrates + 1e-7);
            EXPECT_GE(again.x, pushed.x - 1e-9);
        }
        // Away again it is free, and the picture is as it was.
        const Hall::Moved back = hall.moveTrolley("-4.6", "0.15");
        EXPECT_FALSE(back.stopped);
        EXPECT_EQ(back.x, -4.6);
        EXPECT_TRUE(hall.contacts().empty());
        EXPECT_EQ(pixelsThatDiffer(before, hall.picture("back")), 0u);
        // The same push leads to the same place.
        const Hall::Moved same = hall.moveTrolley("12", "0", true);
        EXPECT_EQ(same.x, pushed.x);
        EXPECT_EQ(pixelsThatDiffer(touching, hall.picture("again")), 0u);

        const json report = hall.finish();
        ASSERT_FALSE(report.is_null()) << hall.logs();
        EXPECT_TRUE(report["faults"].empty()) << report["faults"].dump(2);
        EXPECT_EQ(report["replication"]["state_hash_mismatches"], 0);
        EXPECT_GE(report["collision"]["contacts"].get<int>(), 2) << "it began to touch twice";
        const json& last = report["collision"]["contact_list"];
        ASSERT_FALSE(last.empty());
        EXPECT_TRUE(between(last[0], "/hall/trolley/cart/buffer", "/hall/crates/stack/crate")) << last[0].dump(2);
    }
    // One big picture of the same state, from a wall of one tile that was pushed in the same way.
    Hall hall("1x1");
    ASSERT_TRUE(hall.ready()) << hall.logs();
    EXPECT_EQ(hall.moveTrolley("12", "0", true).x, pushed.x);
    EXPECT_EQ(pixelsThatDiffer(touching, hall.picture("one")), 0u);
}

TEST(CollisionWall, PushedAsideItsEngineStopsAtTheNextEngine) {
    if (engineIsMissing()) GTEST_SKIP() << "the engine is missing (Debian package assimp-testmodels)";
    Hall hall("2x2");
    ASSERT_TRUE(hall.ready()) << hall.logs();
    EXPECT_FALSE(hall.moveTrolley("-7", "0.15").stopped);
    const Hall::Moved pushed = hall.moveTrolley("-7", "3");
    EXPECT_TRUE(pushed.stopped);
    // The row's engine is 2.6 m long and stands at z = 4.1, with a few centimetres of screws.
    EXPECT_GT(pushed.z, 1.4);
    EXPECT_LT(pushed.z, 1.6);
    const json contacts = hall.contacts();
    ASSERT_FALSE(contacts.empty());
    for (const json& contact : contacts)
        EXPECT_TRUE(between(contact, "/hall/trolley/cart/turn/engine", "/hall/right row/machine[0]/turn/engine"))
            << contact.dump(2);
    const Hall::Moved back = hall.moveTrolley("-7", "0.15");
    EXPECT_FALSE(back.stopped);
    EXPECT_TRUE(hall.contacts().empty());
}

}  // namespace
}  // namespace tessera::test
