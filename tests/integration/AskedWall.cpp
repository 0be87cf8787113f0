#include "tests/integration/AskedWall.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace tessera::test {

using namespace std::chrono_literals;
using nlohmann::json;

namespace {

Vec3d vector3(const json& numbers) {
    return {numbers[0].get<double>(), numbers[1].get<double>(), numbers[2].get<double>()};
}

}  // namespace

AskedWall::AskedWall(const AskedWallOptions& options)
    : hosts_(options.wall == "1x1" ? std::vector<std::string>{"all"} : kFourHosts),
      wall_({.wall = options.wall, .scene = options.scene, .size = options.size, .server = options.server}) {}

bool AskedWall::start() {
    if (wall_.address().empty()) return false;
    for (const std::string& host : hosts_) wall_.startClient(host);
    return wall_.waitForFrame("front-0-0", 2, 100s);
}

json AskedWall::ask(std::vector<std::string> words) const {
    words.insert(words.begin(), "--json");
    const Outcome outcome = wall_.ctl(words);
    EXPECT_EQ(outcome.exitCode, 0) << words[1] << ": " << outcome.output;
    const json answer = json::parse(outcome.output, nullptr, false);
    EXPECT_FALSE(answer.is_discarded()) << outcome.output;
    return answer;
}

AskedWall::Moved AskedWall::move(const std::string& node, const std::vector<std::string>& words) const {
    std::vector<std::string> all = {"move", node};
    all.insert(all.end(), words.begin(), words.end());
    const json answer = ask(all);
    if (!answer.is_object() || !answer.contains("translation")) return {};
    return {!answer["stopped"].empty(), vector3(answer["translation"])};
}

Vec3d AskedWall::placeOf(const std::string& node) const {
    return vector3(ask({"tree", node})["core"]["translation"]);
}

void AskedWall::settle() const {
    const std::int64_t frame = ask({"status"})["frame"].get<std::int64_t>();
    EXPECT_TRUE(wall_.waitForFrame("front-0-0", frame + 3, 60s)) << logs();
}

std::string AskedWall::waitForRest() const {
    json last = ask({"status"});
    for (int look = 0; look < 200; ++look) {
        const std::int64_t frame = last["frame"].get<std::int64_t>();
        EXPECT_TRUE(wall_.waitForFrame("front-0-0", frame + 40, 60s)) << logs();
        const json now = ask({"status"});
        if (now["state_hash"] == last["state_hash"]) return now["state_hash"].get<std::string>();
        last = now;
    }
    ADD_FAILURE() << "the scene never comes to rest";
    return {};
}

Picture AskedWall::picture(const std::string& name) const {
    settle();
    const std::string path = wall_.folder() + "/" + name + ".png";
    EXPECT_EQ(wall_.ctl({"snapshot", path}).exitCode, 0);
    const Expected<Bytes> bytes = readFile(path, 64 << 20);
    if (!bytes) return {};
    const Expected<DecodedPng> png = decodePng(*bytes);
    return png ? png->picture : Picture{};
}

json AskedWall::finish() {
    json report = wall_.finish();
    if (report.is_null()) {
        ADD_FAILURE() << "no report\n" << logs();
        return report;
    }
    EXPECT_TRUE(report["faults"].empty()) << report["faults"].dump(2);
    EXPECT_EQ(report["replication"]["state_hash_mismatches"], 0);
    return report;
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

}  // namespace tessera::test
