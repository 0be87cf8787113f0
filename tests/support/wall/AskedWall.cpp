#include "tests/support/wall/AskedWall.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "common/image/Picture.h"

namespace tessera::simulation {

using nlohmann::json;

namespace {

Vec3d vector3(const json& numbers) {
    return {numbers[0].get<double>(), numbers[1].get<double>(), numbers[2].get<double>()};
}

std::vector<std::string> wordsOf(const AskedWallOptions& options) {
    std::vector<std::string> words = {"--samples", "1"};
    words.insert(words.end(), options.server.begin(), options.server.end());
    return words;
}

}  // namespace

AskedWall::AskedWall(const AskedWallOptions& options)
    : SimulatedWall({.scene = options.scene,
                     .wall = options.wall,
                     .widthPx = options.widthPx,
                     .heightPx = options.heightPx,
                     .hosts = false,
                     .journal = options.journal,
                     .record = options.record,
                     .server = wordsOf(options),
                     .seed = options.seed}) {
    if (options.starts) start();
}

void AskedWall::start() {
    startHosts();
    EXPECT_TRUE(waitForFrame(2)) << logs();
}

json AskedWall::ask(std::vector<std::string> words) {
    words.insert(words.begin(), "--json");
    const CommandOutcome told = ctl(words);
    EXPECT_EQ(told.exitCode, 0) << words[1] << ": " << told.output;
    const json answer = json::parse(told.output, nullptr, false);
    EXPECT_FALSE(answer.is_discarded()) << told.output;
    return answer;
}

std::string AskedWall::refused(const std::vector<std::string>& words) {
    const CommandOutcome told = ctl(words);
    EXPECT_NE(told.exitCode, 0) << words[0] << ": " << told.output;
    return told.output;
}

AskedWall::Moved AskedWall::move(const std::string& node, const std::vector<std::string>& words) {
    std::vector<std::string> all = {"move", node};
    all.insert(all.end(), words.begin(), words.end());
    const json answer = ask(all);
    if (!answer.is_object() || !answer.contains("translation")) return {};
    return {!answer["stopped"].empty(), vector3(answer["translation"])};
}

Vec3d AskedWall::placeOf(const std::string& node) {
    return vector3(ask({"tree", node})["core"]["translation"]);
}

bool AskedWall::waitForFrame(std::uint64_t frame) {
    return world().runUntil([&] { return shownFrame() >= frame || !serverLives(); }, 60s) && serverLives();
}

void AskedWall::settle() {
    EXPECT_TRUE(waitForFrame(ask({"status"})["frame"].get<std::uint64_t>() + 3)) << logs();
}

std::string AskedWall::waitForRest() {
    json last = ask({"status"});
    for (int look = 0; look < 200; ++look) {
        EXPECT_TRUE(waitForFrame(last["frame"].get<std::uint64_t>() + 40)) << logs();
        const json now = ask({"status"});
        if (now["state_hash"] == last["state_hash"]) return now["state_hash"].get<std::string>();
        last = now;
    }
    ADD_FAILURE() << "the scene never comes to rest";
    return {};
}

Picture AskedWall::settledPicture() {
    settle();
    // Tiles may be between two frames.
    EXPECT_TRUE(world().runUntil([&] { return shownFrame().has_value(); }, 10s)) << logs();
    return picture().value_or(Picture());
}

json AskedWall::finish() {
    json report = SimulatedWall::finish();
    if (report.is_null()) {
        ADD_FAILURE() << "no report: " << serverError() << "\n" << logs();
        return report;
    }
    EXPECT_TRUE(report["faults"].empty()) << report["faults"].dump(2);
    EXPECT_EQ(report["replication"]["state_hash_mismatches"], 0);
    return report;
}

CommandOutcome runHere(const std::function<int()>& program) {
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    const int code = program();
    const std::string out = testing::internal::GetCapturedStdout();
    return {code, out + testing::internal::GetCapturedStderr()};
}

std::string readText(const std::string& path) {
    const Expected<Bytes> text = readFile(path, 64 << 20);
    return text ? std::string(asText(*text)) : std::string();
}

std::size_t pixelsThatDiffer(const Picture& a, const Picture& b) {
    EXPECT_EQ(a.rgb.size(), b.rgb.size());
    std::size_t count = 0;
    for (std::size_t i = 0; i + 2 < a.rgb.size() && i + 2 < b.rgb.size(); i += 3)
        count += !std::equal(a.rgb.begin() + static_cast<std::ptrdiff_t>(i),
                             a.rgb.begin() + static_cast<std::ptrdiff_t>(i + 3),
                             b.rgb.begin() + static_cast<std::ptrdiff_t>(i));
    return count;
}

bool between(const json& entry, const std::string& a, const std::string& b) {
    const auto begins = [&](std::size_t side, const std::string& path) {
        return entry["objects"][side].get<std::string>().rfind(path, 0) == 0;
    };
    return (begins(0, a) && begins(1, b)) || (begins(0, b) && begins(1, a));
}

}  // namespace tessera::simulation
