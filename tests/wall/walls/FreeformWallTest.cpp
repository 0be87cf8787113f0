/// A smooth surface that is looked at as itself, on a wall: who pulls at its points moves what is
/// touched and how far it is, and the numbers are those of tessera-collide.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "server/tools/CollideCommand.h"
#include "server/tools/evaluate/EvaluateCommand.h"
#include "tests/support/wall/AskedWall.h"

namespace tessera::simulation {
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
    "v -0.25 -0.5 -0.25\nv 0.25 -0.5 -0.25\nv 0.25 0.5 -0.25\nv -0.25 0.5 -0.25\nv -0.25 -0.5 0.25\nv 0.25 -0.5 "
    "0.25\nv 0.25 0.5 0.25\nv -0.25 0.5 0.25\n"
    "f 1 4 3\nf 1 3 2\nf 5 6 7\nf 5 7 8\nf 1 2 6\nf 1 6 5\nf 4 8 7\nf 4 7 3\nf 1 5 8\nf 1 8 4\nf 2 3 7\nf 2 7 6\n";

class FreeformWall : public AskedWall {
public:
    FreeformWall()
        : AskedWall({.wall = "1x1", .scene = std::string(TESSERA_SOURCE_DIR) + "/tests/data/scenes/freeform.tsct"}) {}
    [[nodiscard]] json distance() {
        const json all = ask({"contacts", "--distances"})["distances"];
        EXPECT_EQ(all.size(), 1U) << all;
        return all.at(0);
    }
    /// What tessera-collide says of the same two, the block at a place.
    [[nodiscard]] static json collide(const std::string& query, double top, const Vec3d& block,
                                      const std::string& asB = "triangles") {
        const test::TestFolder files;
        const std::string pose = std::to_string(block.x()) + " " + std::to_string(block.y()) + " " +
                                 std::to_string(block.z()) + " 1 0 0 0\n";
        const CommandOutcome out = runHere([&] {
            return runCollide({files.write("pillow.obj", pillowObj(top)), files.write("block.obj", kBlockObj),
                               "--poses", files.write("poses", pose), "--query", query, "--as-a", "subdivision",
                               "--as-b", asB, "--json", "--allow-unconfined-import"});
        });
        EXPECT_EQ(out.exitCode, 0) << out.output;
        return json::parse(out.output.substr(0, out.output.find('\n')));
    }
    void pullTop(const char* y) {
        tell({"set", "/pillow/skin", "points@4", "-1", y, "1", "1", y, "1", "1", y, "-1", "-1", y, "-1"});
    }
};

void expectAsCollideSays(const json& told, const json& truth) {
    EXPECT_GT(told["error"], 0.0);
    EXPECT_LT(told["error"], 1e-3);
    EXPECT_NEAR(told["distance"].get<double>(), truth["distance"].get<double>(),
                told["error"].get<double>() + truth["error"].get<double>() + 1e-9);
}

/// Where the pillow's contact with the block is by its own face and parameters.
const json& patchOf(const json& contact) {
    const json &a = contact["patches"][0], &b = contact["patches"][1];
    EXPECT_NE(a.is_null(), b.is_null()) << contact;
    return a.is_null() ? b : a;
}

Vec3d pointOf(const json& xyz) {
    return Vec3d(xyz[0].get<double>(), xyz[1].get<double>(), xyz[2].get<double>());
}

/// Every contact of the wall is one of tessera-collide's: at its place, of the same face, at the same (u, v).
void expectContactsAsCollideSays(const json& contacts, const json& truth) {
    ASSERT_FALSE(contacts.empty());
    ASSERT_FALSE(truth["contacts"].empty());
    const double error = contacts.at(0)["error"].get<double>() + truth["error"].get<double>();
    int compared = 0;
    for (const json& contact : contacts) {
        const json& patch = patchOf(contact);
        double nearest = 1e9;
        for (const json& of : truth["contacts"]) {
            const double apart = (pointOf(of["point"]) - pointOf(contact["point"])).norm();
            nearest = std::min(nearest, apart);
            // What lies on an edge is of either face.
            if (of["faces"][0] != patch["face"] || apart > 0.05) continue;
            ++compared;
            const double uv = std::hypot(of["uv"][0][0].get<double>() - patch["uv"][0].get<double>(),
                                         of["uv"][0][1].get<double>() - patch["uv"][1].get<double>());
            EXPECT_LE(uv, 4 * (apart + error) + 1e-9) << contact << of;
        }
        // Every place where they meet is within four 64ths of the smaller one's size of a contact.
        EXPECT_LE(nearest, 4 * 1.25 / 64 + error) << contact;
    }
    EXPECT_GT(compared, 0);
}

TEST(FreeformWall, ContactsNameThePatchAndItsParametersAndTheFacesThatAreDrawn) {
    FreeformWall wall;
    const Vec3d within(0.45, 1.0, 0.45);
    wall.tell({"move", "/block", "0.45", "1", "0.45"});
    const json contacts = wall.contacts();
    expectContactsAsCollideSays(contacts, wall.collide("all", 1, within));
    // tessera-evaluate says where that is.
    const test::TestFolder files;
    std::string places;
    for (const json& contact : contacts)
        places += patchOf(contact)["face"].dump() + " " + patchOf(contact)["uv"][0].dump() + " " +
                  patchOf(contact)["uv"][1].dump() + "\n";
    const CommandOutcome said = runHere([&] {
        return runEvaluate({files.write("pillow.obj", pillowObj(1)), "--at", files.write("places", places), "--json"});
    });
    ASSERT_EQ(said.exitCode, 0) << said.output;
    std::istringstream lines(said.output);
    for (const json& contact : contacts) {
        std::string line;
        ASSERT_TRUE(std::getline(lines, line));
        EXPECT_LE((pointOf(json::parse(line)["point"]) - pointOf(contact["point"])).norm(),
                  contact["error"].get<double>() + 1e-6)
            << contact;
    }
    // For people: the patch, and where on it. Faces are still those that are drawn: level 1 has 48.
    EXPECT_NE(wall.ctl({"contacts"}).output.find(" at 0."), std::string::npos);
    for (const json& contact : contacts) {
        const bool first = !contact["patches"][0].is_null();
        EXPECT_LT(contact["faces"][first ? 0 : 1].get<int>(), 48);
    }
    // As triangles it has no patches.
    wall.tell({"set", "/pillow/body", "shape", "triangles"});
    for (const json& contact : wall.contacts()) EXPECT_EQ(contact["patches"], json::parse("[null,null]"));
    const json report = wall.finish();
    EXPECT_EQ(report["replication"]["state_hash_mismatches"], 0);
}

TEST(FreeformWall, WhoIsStoppedStopsAtTheFirstContactWithTheSurfaceNotAtItsTriangles) {
    FreeformWall wall;
    wall.tell({"set", "/near", "response", "stop"});  // the first that speaks of the two
    const auto fromAbove = [&](double top, const char* down) {
        wall.tell({"move", "/block", "0.45", "4", "0.45"});
        const AskedWall::Moved moved = wall.move("/block", {"0.45", down, "0.45"});
        EXPECT_TRUE(moved.stopped);
        const json distance = wall.collide("distance", top, moved.place);
        // Half of the stop tolerance, a ten-thousandth of the block's size, of way; and the parameters of where it was
        // met.
        EXPECT_GT(distance["distance"].get<double>(), 0);
        EXPECT_LT(distance["least"].get<double>(), 0.6e-4 * std::sqrt(1.5));
        const json contacts = wall.contacts();
        EXPECT_FALSE(contacts.empty());
        if (!contacts.empty()) {
            EXPECT_EQ(patchOf(contacts.at(0))["face"], distance["faces"][0]);
            for (int k = 0; k < 2; ++k)
                EXPECT_NEAR(patchOf(contacts.at(0))["uv"][static_cast<std::size_t>(k)].get<double>(),
                            distance["uv"][0][static_cast<std::size_t>(k)].get<double>(), 0.02);
        }
        return moved.place.y();
    };
    const double first = fromAbove(1, "-3");
    EXPECT_NEAR(fromAbove(1, "-30000"), first, 1e-4) << "however fast";
    wall.tell({"move", "/block", "0.45", "4", "0.45"});
    wall.pullTop("2");
    EXPECT_GT(fromAbove(2, "-3"), first + 0.3);
    const json report = wall.finish();
    EXPECT_EQ(report["replication"]["state_hash_mismatches"], 0);
}

TEST(FreeformWall, ContactsAndDistancesAreThoseOfTheSmoothSurfaceAndFollowItsPoints) {
    FreeformWall wall;
    const Vec3d above(0.45, 3, 0.45), within(0.45, 1.2, 0.45);
    const json first = wall.distance();
    expectAsCollideSays(first, wall.collide("distance", 1, above));
    for (const char* field : {"spherical", "distance-field"})
        expectAsCollideSays(first, wall.collide("distance", 1, above, field));
    EXPECT_TRUE(wall.contacts().empty());
    EXPECT_NE(wall.ctl({"contacts", "--distances"}).output.find(" +- "), std::string::npos);

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
    EXPECT_NEAR(wall.distance()["distance"].get<double>(), first["distance"].get<double>(),
                2 * first["error"].get<double>());

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
}  // namespace tessera::simulation
