#include "server/tools/SceneTriangles.h"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/words/Words.h"
#include "tests/unit/TestFolder.h"

namespace tessera {
namespace {

class SceneTriangles : public testing::Test {
protected:
    Expected<TriangleMesh> read(const std::string& name, const std::string& text) {
        return readTriangles(written(name, text), options());
    }
    Expected<FilePoints> points(const std::string& name, const std::string& text) {
        return readPoints(written(name, text), options());
    }
    std::string written(const std::string& name, const std::string& text) {
        const std::string path = folder_ / name;
        std::ofstream(path) << text;
        return path;
    }
    static ImportOptions options() {
        ImportOptions options;
        options.importerProgram = TESSERA_BIN_DIR "/tessera-import";
        options.allowUnconfined = true;
        return options;
    }
    test::TestFolder folder_;
};

TEST_F(SceneTriangles, PointsOfAFileStandInTheWorldWithTheirRadius) {
    const auto scan = points("scan.tsct",
                             "node { transform { translation { x: 10 } scale { x: 2 y: 2 z: 2 } }\n"
                             "  points { spacing: 0.5 radius: 0.25 box { size { x: 1 y: 1 z: 1 } } } }\n");
    ASSERT_TRUE(scan) << scan.error().message;
    EXPECT_GT(scan->places.size(), 10u);
    EXPECT_NEAR(scan->radius, 0.5, 1e-6);
    for (const Vec3d& p : scan->places) EXPECT_NEAR((p - Vec3d(10, 0, 0)).cwiseAbs().maxCoeff(), 1, 1e-5);
    const auto cloud = points("cloud.ply",
                              "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                              "property float z\nend_header\n0 0 0\n1 0 0\n0 0 2\n");
    ASSERT_TRUE(cloud) << cloud.error().message;
    ASSERT_EQ(cloud->places.size(), 3u);
    EXPECT_EQ(cloud->places[2], Vec3d(0, 0, 2));
    const auto none = points("box.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    ASSERT_FALSE(none);
    EXPECT_WORDS(none.error().message);
}

TEST_F(SceneTriangles, WhatIsMissingIsRefusedAndWhatMayBeCutIsSaid) {
    const std::string cloud = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    const auto whole = points("cloud.obj", cloud + "p 1\np 2\np 3\n");
    ASSERT_TRUE(whole) << whole.error().message;
    EXPECT_EQ(whole->places.size(), 3u);
    for (const char* wrong : {"p 1\np 2\np 7\n", "p 1\np 2\np 3\nf 1 2 9\n"}) {
        const auto refused = points("wrong.obj", cloud + wrong);
        ASSERT_FALSE(refused) << wrong;
        EXPECT_WORDS(refused.error().message);
    }
    const auto notesOf = [&](const std::string& name, const std::string& text) {
        std::vector<std::string> notes;
        EXPECT_TRUE(readTriangles(written(name, text), options(), &notes));
        return notes;
    };
    const std::string off = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2";
    for (const auto& [name, text] :
         {std::pair(std::string("cut.obj"), cloud + "f 1 2 3"), {std::string("cut.off"), off}}) {
        const std::vector<std::string> notes = notesOf(name, text);
        ASSERT_EQ(notes.size(), 1u) << name;
        EXPECT_WORDS(notes[0]);
        EXPECT_TRUE(notesOf(name, text + "\n").empty()) << name;
    }
}

TEST_F(SceneTriangles, OfSurfacesByControlPointsComeAfterThePolygons) {
    const std::string square =
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\ncstype bspline\ndeg 1 1\nsurf 0 1 0 1 1 2 3 4\nparm u 0 0 1 1\nparm v 0 0 "
        "1 1\nend\n";
    const auto alone = read("square.obj", square);
    ASSERT_TRUE(alone) << alone.error().message;
    EXPECT_EQ(alone->faceCount(), 2u);
    const auto both = read("both.obj", square + "v 9 0 0\nv 9 1 0\nv 9 0 1\nf -3 -2 -1\n");
    ASSERT_TRUE(both) << both.error().message;
    ASSERT_EQ(both->faceCount(), 3u);
    EXPECT_EQ(both->corner(0, 0), Vec3d(9, 0, 0));
    for (std::uint32_t f = 1; f < 3; ++f) EXPECT_LE(both->corner(f, 0).x(), 1) << f;
}

TEST_F(SceneTriangles, KeepTheOrderOfTheFile) {
    // Two materials in turns: a reader that sorts by material would give 0 2 1 3.
    const auto mesh = read("turns.obj",
                           "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 0 2\nv 0 0 3\nv 0 0 4\n"
                           "usemtl red\nf 1 2 4\nusemtl blue\nf 1 2 5\nusemtl red\nf 1 2 6\nusemtl blue\nf 1 2 7\n");
    ASSERT_TRUE(mesh) << mesh.error().message;
    ASSERT_EQ(mesh->faceCount(), 4u);
    for (std::uint32_t f = 0; f < 4; ++f) EXPECT_EQ(mesh->corner(f, 2), Vec3d(0, 0, f + 1)) << f;
}

TEST_F(SceneTriangles, FanPolygons) {
    const auto mesh =
        read("fan.obj", "v 0 0 0\nv 2 0 0\nv 3 1 0\nv 1 3 0\nv -1 1 0\nf 1 2 3 4 5\nl 1 2\nf 3 4 5\nf 1 2 3 4\n");
    ASSERT_TRUE(mesh) << mesh.error().message;
    ASSERT_EQ(mesh->faceCount(), 6u);
    const Vec3d corners[] = {{0, 0, 0}, {2, 0, 0}, {3, 1, 0}, {1, 3, 0}, {-1, 1, 0}};
    const int fans[6][3] = {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {2, 3, 4}, {0, 1, 2}, {0, 2, 3}};
    for (std::uint32_t f = 0; f < 6; ++f)
        for (unsigned i = 0; i < 3; ++i) EXPECT_EQ(mesh->corner(f, i), corners[fans[f][i]]) << f << " " << i;
}

TEST_F(SceneTriangles, FanPolygonsThatAreNotConvexToo) {
    // Seen from its first corner the fan folds over; dividing it to look right would begin elsewhere.
    const auto mesh = read("dart.obj", "v 0 0 0\nv 4 0 0\nv 1 1 0\nv 0 4 0\nf 2 3 4 1\n");
    ASSERT_TRUE(mesh) << mesh.error().message;
    ASSERT_EQ(mesh->faceCount(), 2u);
    for (std::uint32_t f = 0; f < 2; ++f) EXPECT_EQ(mesh->corner(f, 0), Vec3d(4, 0, 0));
    EXPECT_EQ(mesh->corner(0, 1), Vec3d(1, 1, 0));
    EXPECT_EQ(mesh->corner(1, 2), Vec3d(0, 0, 0));
}

TEST_F(SceneTriangles, HaveTheNearestFloatsOfTheFilesNumbers) {
    // Sums of a whole part and a fraction, and powers of ten by multiplication, would be a unit off in the last place.
    const char* numbers[] = {"16777217.0", "3.1415926535897932",   "1234.56789", "7.1e-46", "-0.1e-3", "8.5070594e37",
                             "+5.",        ".3333333333333333333", "1e-60"};
    const float nearest[] = {16777216.0f, 3.1415927f, 1234.5679f, 1e-45f, -1e-4f, 8.507059e37f, 5, 0.33333334f, 0};
    for (std::size_t i = 0; i < std::size(numbers); ++i) {
        const std::string x = numbers[i];
        const std::pair<std::string, std::string> files[] = {
            {"number.obj", "v " + x + " 0 0\nv 0 1 0\nv 0 0 1\nf -3/1/1 -2//2 -1\n"},
            {"number.OFF", "OFF\n3 1 0\n" + x + " 0 0\n0 1 0 # up\n\n0 0 1\n3 0 1 2 255 0 0\n"},
            {"number.ply",
             "ply\nformat ascii 1.0\ncomment by hand\nelement vertex 3\nproperty float nx\nproperty float x\nproperty "
             "float "
             "y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n9 " +
                 x + " 0 0\n9 0 1 0\n9 0 0 1\n3 0 1 2\n"},
            {"number.stl", "solid s\nfacet normal 0 0 1\nouter loop\nvertex " + x +
                               " 0 0\nvertex 0 1 0\nvertex 0 0 1\nendloop\nendfacet\nendsolid s\n"}};
        for (const auto& [name, text] : files) {
            const auto mesh = read(name, text);
            ASSERT_TRUE(mesh) << mesh.error().message;
            ASSERT_EQ(mesh->faceCount(), 1u);
            EXPECT_EQ(mesh->corner(0, 0).x(), static_cast<double>(nearest[i])) << x << " in " << name;
            EXPECT_EQ(mesh->corner(0, 2), Vec3d(0, 0, 1)) << name;
        }
    }
}

TEST_F(SceneTriangles, OfBrokenTextSayTheLine) {
    const struct {
        const char *name, *text;
    } cases[] = {{"a.obj", "v 0 0 0\nv 1 0\n"},
                 {"b.obj", "v 0 0 0\n\nf 1 2 1\n"},
                 {"c.obj", "v 0 0 0\nf 0 1 1\n"},
                 {"d.obj", "v 0 nan 0\n"},
                 {"e.obj", "v 0 1e39 0\n"},
                 {"f.obj", "v 0 0 0\nf -9 1 1\n"},
                 {"a.off", "OFF\n3 1 0\n0 0 0\n"},
                 {"b.off", "OFF\n1 1 0\n0 0 0\n3 0 0 1\n"},
                 {"c.off", "OFF\n1 1 0\n0 0 0\n4000000000 0 0\n"},
                 {"a.ply", "ply\nformat ascii 1.0\nelement vertex 2\n"},
                 {"b.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n"},
                 {"a.stl", "solid s\nouter loop\nvertex 0 0\n"},
                 {"d.off", "3 1 0\n"}};
    for (const auto& c : cases) {
        const auto mesh = read(c.name, c.text);
        ASSERT_FALSE(mesh) << c.name;
        EXPECT_EQ(mesh.error().code, ErrorCode::kBadInput) << c.name;
        EXPECT_WORDS(mesh.error().message);
    }
}

/// Whoever computes with a file wants all of it: what a wall shows as far as it is whole is refused here, in the words
/// of the wall's note.
TEST_F(SceneTriangles, OfAFileThatIsNotWholeAreRefused) {
    const auto bytesOf = [](auto... numbers) {
        std::string bytes;
        (bytes.append(reinterpret_cast<const char*>(&numbers), sizeof(numbers)), ...);
        return bytes;
    };
    std::string stl(80, ' ');
    stl += bytesOf(std::uint32_t{2});
    for (const float x : {0.0f, 1.0f})
        stl += bytesOf(0.0f, 0.0f, 1.0f, x, 0.0f, 0.0f, x + 1, 0.0f, 0.0f, x, 1.0f, 0.0f, std::uint16_t{0});
    const std::string corners = bytesOf(0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 1.0f, 1.0f, 0.0f);
    const std::string head =
        "ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float "
        "z\n";
    const std::string faces = "element face 2\nproperty list uchar int vertex_indices\nend_header\n";
    const auto triangle = [&](std::int32_t a, std::int32_t b, std::int32_t c) { return "\3" + bytesOf(a, b, c); };
    const std::string ply = head + faces + corners + triangle(0, 1, 2) + triangle(1, 3, 2);
    const struct {
        const char* name;
        std::string whole, broken;
    } cases[] = {
        {"a.stl", stl, stl.substr(0, 150)},
        {"a.ply", ply, ply.substr(0, ply.size() - 5)},
        {"b.ply", ply, head + faces + corners + triangle(0, 1, 2) + triangle(1, 3, 77)},
        {"c.ply", ply, head + faces + corners + triangle(0, 1, 2) + std::string(1, '\0')},
    };
    for (const auto& c : cases) {
        const auto whole = read(c.name, c.whole);
        ASSERT_TRUE(whole) << whole.error().message;
        EXPECT_EQ(whole->faceCount(), 2u);
        const auto broken = read(c.name, c.broken);
        ASSERT_FALSE(broken) << c.name << " has " << broken->faceCount();
        EXPECT_EQ(broken.error().code, ErrorCode::kBadInput);
        EXPECT_WORDS(broken.error().message);
    }
    // Within a scene, too.
    (void)written("a.stl", stl.substr(0, 150));
    const auto imported = read("hall.tsct", "node { name: \"hall\" import { uri: \"a.stl\" } }\n");
    ASSERT_FALSE(imported) << imported->faceCount();
    EXPECT_WORDS(imported.error().message);
    // Points, in both kinds of PLY.
    for (const std::string& cloud : {head + "end_header\n" + corners.substr(0, 30),
                                     std::string("ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty "
                                                 "float y\nproperty float z\nend_header\n0 0 0\n1 0 0\n")}) {
        const auto cut = points("cloud.ply", cloud);
        ASSERT_FALSE(cut) << cut->places.size();
        EXPECT_WORDS(cut.error().message);
    }
}

TEST_F(SceneTriangles, KeepFacesWithoutArea) {
    const auto mesh = read("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 4\nf 1 1 4\nf 1 3 4\n");
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->faceCount(), 4u);
}

TEST_F(SceneTriangles, AreInWorldCoordinates) {
    const auto mesh = read("placed.tsct",
                           "node { name: \"outer\" transform { translation { x: 10 } } node { name: \"box\" "
                           "transform { scale { x: 2 y: 2 z: 2 } } box { size { x: 1 y: 1 z: 1 } } } }");
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->faceCount(), 12u);
    EXPECT_EQ(mesh->vertexCount(), 8u) << "corners of a box that differ in their normals alone are one";
    EXPECT_EQ(mesh->bounds().lower, Vec3d(9, -1, -1));
    EXPECT_EQ(mesh->bounds().upper, Vec3d(11, 1, 1));
}

TEST_F(SceneTriangles, OfAFileWithoutAnyAreAnError) {
    const auto mesh = read("points.tsct", "node { name: \"nothing\" }");
    ASSERT_FALSE(mesh);
    EXPECT_EQ(mesh.error().code, ErrorCode::kBadInput);
    EXPECT_WORDS(mesh.error().message);
}

}  // namespace
}  // namespace tessera
