/// A smooth surface that is looked at as itself, on a wall of real processes: who pulls at its points moves what is touched and how far it is,
/// and the numbers are those of tessera-collide.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/integration/AskedWall.h"

namespace tessera::test {
namespace {

using nlohmann::json;

/// The pillow's points and faces, its top at a height.
std::string pillowObj(double top) {
    std::string text;
    for (const double y : {-1.0, top})
        for (const auto& [x, z] : {std::pair(-1, 1), std::pair(1, 1), std::pair(1, -1), std::pair(-1, -1)})
            text += "v " + std::to_string(x) + " " + std::to_string(y) + " " + std::to_string(z) + "\n";
    return text + "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 2 3 7 6\nf 1 5 8 4\n";
}

constexpr const char* kBlockObj =
    "v -0.25 -0.5 -0.25\nv 0.25 -0.5 -0.25\nv 0.25 0.5 -0.25\nv -0.25 0.5 -0.25\nv -0.25 -0.5 0.25\nv 0.25 -0.5 0.25\nv 0.25 0.5 0.25\nv -0.25 0.5 0.25\n"
    "f 1 4 3\nf 1 3 2\nf 5 6 7\nf 5 7 8\nf 1 2 6\nf 1 6 5\nf 4 8 7\nf 4 7 3\nf 1 5 8\nf 1 8 4\nf 2 3 7\nf 2 7 6\n";

class FreeformWall : public AskedWall {
public:
    FreeformWall() : AskedWall({.wall = "1x1", .scene = std::string(TESSERA_SOURCE_DIR) + "/tests/data/scenes/freeform.tsct"}), ready(start()) {}
    [[nodiscard]] json distance() const {
        const json all = ask({"contacts", "--distances"})["distances"];
        EXPECT_EQ(all.size(), 1U) << all;
        return all.at(0);
    }
    /// What tessera-collide says of the same two, the block at a place.
    [[nodiscard]] json collide(const std::string& query, double top, const Vec3d& block, const std::string& asB = "triangles") const {
        const TemporaryFolder files;
        const std::string pose = std::to_string(block.x()) + " " + std::to_string(block.y()) + " " + std::to_string(block.z()) + " 1 0 0 0\n";
        const Outcome out = run(files.path(), {program("tessera-collide"), files.write("pillow.obj", pillowObj(top)), files.write("block.obj", kBlockObj), "--poses",
                                               files.write("poses", pose), "--query", query, "--as-a", "subdivision", "--as-b", asB, "--json", "--allow-unconfined-import"});
        EXPECT_EQ(out.exitCode, 0) << out.output;
        return json::parse(out.output.substr(0, out.output.find('\n')));
    }
    void pullTop(const char* y) const { tell({"set", "/pillow/skin", "points@4", "-1", y, "1", "1", y, "1", "1", y, "-1", "-1", y, "-1"}); }
    const bool ready;
};

void expectAsCollideSays(const json& told, const json& truth) {
    EXPECT_GT(told["error"], 0.0);
    EXPECT_LT(told["error"], 1e-3);
    EXPECT_NEAR(told["distance"].get<double>(), truth["distance"].get<double>(), told["error"].get<double>() + truth["error"].get<double>() + 1e-9);
}

TEST(FreeformWall, ContactsAndDistancesAreThoseOfTheSmoothSurfaceAndFollowItsPoints) {
    FreeformWall wall;
    ASSERT_TRUE(wall.ready) << wall.logs();
    const Vec3d above(0.45, 3, 0.45), within(0.45, 1.2, 0.45);
    const json first = wall.distance();
    expectAsCollideSays(first, wall.collide("distance", 1, above));
    for (const char* field : {"spherical", "distance-field"}) expectAsCollideSays(first, wall.collide("distance", 1, above, field));
    EXPECT_TRUE(wall.contacts().empty());
    EXPECT_NE(wall.wall().ctl({"contacts", "--distances"}).output.find(" +- "), std::string::npos);

    wall.pullTop("2");
    const json pulled = wall.distance();
    expectAsCollideSays(pulled, wall.collide("distance", 2, above));
    EXPECT_LT(pulled["distance"].get<double>(), first["distance"].get<double>() - 0.3);

    // The block goes in where the surface is, and the triangles are not: level 1 is coarse.
    wall.tell({"move", "/block", "0.45", "1.2", "0.45"});
    EXPECT_TRUE(wall.collide("any", 2, within)["hit"].get<bool>());
    const json contacts = wall.contacts();
    ASSERT_FALSE(contacts.empty());
    EXPECT_GT(contacts.at(0)["error"], 0.0);
    EXPECT_EQ(wall.distance()["distance"], 0.0);

    wall.tell({"undo"});
    wall.tell({"undo"});
    EXPECT_NEAR(wall.distance()["distance"].get<double>(), first["distance"].get<double>(), 2 * first["error"].get<double>());

    // As the triangles it is exact of these, and farther: they lie within the surface.
    wall.tell({"set", "/pillow/body", "shape", "triangles"});
    const json drawn = wall.distance();
    EXPECT_EQ(drawn["error"], 0.0);
    EXPECT_GT(drawn["distance"].get<double>(), first["distance"].get<double>() + 0.005);
    wall.tell({"set", "/pillow/body", "shape", "freeform"});
    const json report = wall.finish();
    EXPECT_EQ(report["collision"]["stand_ins"]["count"], 0);
    EXPECT_EQ(report["replication"]["state_hash_mismatches"], 0);
}

}  // namespace
}  // namespace tessera::test
