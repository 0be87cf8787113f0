/// Files of warp meshes, and what is wrong with meshes.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "common/output/MeshFile.h"
#include "tests/support/words/Words.h"
#include "tests/unit/output/OutputScenes.h"

namespace tessera::test {
namespace {

std::string errorIn(const std::string& text) {
    const auto mesh = readMesh(text, "left.warp", 2);
    return mesh ? "accepted" : mesh.error().message;
}

const std::string kGood =
    "2\n2 3\n# x y u v i\n-2 -1 0 0 1\n2 -1 1 0 1\n-2 0 0 0.5 1\n2 0 1 .5 0.25\n-2 1 0 1 1\n\n2 1 1 1 1\n";

TEST(MeshFile, ReadsTypeSizeAndNodes) {
    const auto mesh = readMesh(kGood, "left.warp", 2);
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->columns, 2);
    EXPECT_EQ(mesh->rows, 3);
    EXPECT_EQ(mesh->at(1, 1), (WarpNode{.x = 1, .y = 0, .u = 1, .v = 0.5f, .intensity = 0.25f}));
}

TEST(MeshFile, ComesBackFromItsText) {
    for (unsigned seed = 0; seed < 50; ++seed) {
        std::mt19937 random(seed);
        const double aspect = std::uniform_real_distribution<double>(0.3, 3)(random);
        const WarpMesh mesh = straightMesh(2 + static_cast<int>(random() % 20), 2 + static_cast<int>(random() % 20));
        const auto back = readMesh(meshText(mesh, aspect), "f", aspect);
        ASSERT_TRUE(back) << back.error().message;
        for (std::size_t i = 0; i < mesh.nodes.size(); ++i) {
            EXPECT_NEAR(back->nodes[i].x, mesh.nodes[i].x, 1e-6);
            EXPECT_EQ(back->nodes[i].v, mesh.nodes[i].v);
        }
    }
}

TEST(MeshFile, SaysWhatIsWrongAndAtWhichNode) {
    const auto after = [](const std::string& from, const std::string& to) {
        std::string text = kGood;
        return errorIn(text.replace(text.find(from), from.size(), to));
    };
    EXPECT_EQ(errorIn(kGood), "accepted");
    EXPECT_EQ(errorIn("").substr(0, 30), "left.warp:1: not a warp mesh: ");
    EXPECT_WORDS(after("2\n2 3", "1\n2 3"));
    EXPECT_WORDS(after("2 3", "2"));
    EXPECT_WORDS(after("2 3", "1 3"));
    EXPECT_WORDS(after("2 3", "99999 99999"));
    EXPECT_WORDS(after("2 3", "2 4"));
    EXPECT_WORDS(after("2 3", "2 2"));
    EXPECT_WORDS(after("2 0 1 .5 0.25", "2 0 1 .5 -1"));
    EXPECT_WORDS(after("2 0 1 .5 0.25", "2 nan 1 .5 1"));
    EXPECT_WORDS(after("2 0 1 .5 0.25", "2 0 1 .5"));
    EXPECT_WORDS(after("2 0 1 .5 0.25", "2 0 1 .5 x"));
    EXPECT_WORDS(after("2 0 1 .5 0.25", "2 0 1 .5 2"));
    EXPECT_WORDS(after("2 0 1 .5 0.25", "2 40 1 .5 1"));
    EXPECT_WORDS(after("2 0 1 .5 0.25", "2 1.5 1 .5 1")) << "beyond the row above";
    EXPECT_WORDS(after("2 0 1 .5 0.25", "2 0 1 1.5 1"));
    EXPECT_WORDS(after("2 0 1 .5 0.25", "-2 0 0 .5 1"));
    for (const char* shown : {"0.5 0.5", "0.5 y"}) {
        std::string text = "2\n2 2\n";
        for (const char* place : {"-2 -1", "2 -1", "-2 1", "2 1"})
            text +=
                std::string(place) + ' ' +
                (shown[4] == 'y' ? std::string("0.5 ") + (place[std::strlen(place) - 2] == '-' ? "0" : "1") : shown) +
                " 1\n";
        EXPECT_WORDS(errorIn(text));
    }
    EXPECT_EQ(errorIn("\xEF\xBB\xBF" + kGood), "accepted");
}

TEST(MeshFile, AnswersDamageWithAMessage) {
    std::mt19937 random(9);
    for (int i = 0; i < 4000; ++i) {
        std::string text = kGood;
        for (int k = 0; k < 3; ++k) text[random() % text.size()] = static_cast<char>(random());
        EXPECT_FALSE(errorIn(text).empty());
        EXPECT_FALSE(errorIn(text.substr(0, random() % text.size())).empty());
    }
}

/// The oracle walks along each face's edges: one whose corners do not all turn the same way, or that turns another way
/// than the rest.
TEST(Meshes, FoldsAreFoundWhereverTheyAre) {
    int folded = 0, good = 0;
    for (unsigned seed = 0; seed < 600; ++seed) {
        std::mt19937 random(seed);
        const int columns = 2 + static_cast<int>(random() % 6), rows = 2 + static_cast<int>(random() % 6);
        WarpMesh mesh = straightMesh(columns, rows);
        if (random() % 2 == 0)
            for (WarpNode& n : mesh.nodes) n.x = -n.x;  // the mirror image is no fold
        WarpNode& moved = mesh.nodes[random() % mesh.nodes.size()];
        std::uniform_real_distribution<float> shift(-0.8f, 0.8f);
        moved.x += shift(random);
        moved.y += shift(random);
        bool convex = true;
        int side = 0;
        for (int r = 0; r + 1 < rows; ++r) {
            for (int c = 0; c + 1 < columns; ++c) {
                const WarpNode* way[6] = {&mesh.at(c, r),     &mesh.at(c + 1, r), &mesh.at(c + 1, r + 1),
                                          &mesh.at(c, r + 1), &mesh.at(c, r),     &mesh.at(c + 1, r)};
                for (int i = 0; i < 4; ++i) {
                    const double before = std::atan2(way[i + 1]->y - way[i]->y, way[i + 1]->x - way[i]->x),
                                 behind = std::atan2(way[i + 2]->y - way[i + 1]->y, way[i + 2]->x - way[i + 1]->x);
                    const int turn = std::sin(behind - before) > 0 ? 1 : -1;
                    convex = convex && (side == 0 || turn == side);
                    side = side == 0 ? turn : side;
                }
            }
        }
        EXPECT_EQ(!findWarpFault(mesh), convex)
            << again("Meshes.Folds*", seed) << ' ' << findWarpFault(mesh).value_or("good");
        ++(convex ? good : folded);
    }
    EXPECT_GT(good, 50);
    EXPECT_GT(folded, 50);
}

}  // namespace
}  // namespace tessera::test
