// tessera-collide on smooth surfaces: words, files, answers.
#include "server/tools/CollideFreeform.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "server/collision/pairwise/PairTable.h"
#include "tests/support/words/Words.h"
#include "tests/unit/TestFolder.h"

namespace tessera {
namespace {

class FreeformFiles : public testing::Test {
protected:
    std::string file(const std::string& name, const std::string& text) const { return scratch_.write(name, text); }

private:
    test::TestFolder scratch_;

protected:
    std::filesystem::path folder_ = scratch_.path();
};

/// A cube of side 2; with sharp edges everywhere it is its own limit.
std::string cube(bool sharp) {
    std::string text;
    for (int i = 0; i < 8; ++i)
        text += std::string("v ") + ((i & 1) != 0 ? "1 " : "-1 ") + ((i & 2) != 0 ? "1 " : "-1 ") +
                ((i & 4) != 0 ? "1\n" : "-1\n");
    text += "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    const char* edges[] = {"0/1", "1/3", "3/2", "2/0", "4/5", "5/7", "7/6", "6/4", "0/4", "1/5", "2/6", "3/7"};
    for (const char* e : edges)
        if (sharp) text += std::string("t crease 2/1/0 ") + e[0] + " " + e[2] + " 10\n";
    return text;
}

TEST_F(FreeformFiles, AnswersNameFacesAndTheirParameters) {
    const std::string path = file("cube.obj", cube(true));
    CollideArguments arguments{.a = path,
                               .b = path,
                               .freeformA = FreeformKind::kSubdivision,
                               .freeformB = FreeformKind::kSubdivision,
                               .format = AnswerFormat::kJson};
    const Expected<FreeformShape> a = loadFreeform(path, arguments.freeformA, Representation::kTriangles, arguments);
    const Expected<FreeformShape> b = loadFreeform(path, std::nullopt, Representation::kHull, arguments);
    ASSERT_TRUE(a) << a.error().message;
    ASSERT_TRUE(b) << b.error().message;
    FreeformPair pair(*a, *b);
    double us = 0;
    PoseLine pose;
    pose.start.translation = {3, 0.25, 0};
    arguments.query = CollideQuery::kDistance;
    nlohmann::json said = nlohmann::json::parse(freeformAnswer(pair, pose, arguments, us));
    EXPECT_NEAR(said["distance"], 1, 1e-5);
    EXPECT_LE(said["least"], said["distance"]);
    EXPECT_NEAR(said["points"][0][0], 1, 1e-9);
    EXPECT_NEAR(said["points"][1][0], 2, 1e-9);
    EXPECT_EQ(said["uv"].size(), 2U);
    arguments.query = CollideQuery::kAny;
    EXPECT_EQ(nlohmann::json::parse(freeformAnswer(pair, pose, arguments, us))["hit"], false);
    pose.start.translation.x() = 1.5;
    EXPECT_EQ(nlohmann::json::parse(freeformAnswer(pair, pose, arguments, us))["hit"], true);
    arguments.query = CollideQuery::kAll;
    said = nlohmann::json::parse(freeformAnswer(pair, pose, arguments, us));
    EXPECT_GT(said["contacts"].size(), 4U);
    EXPECT_EQ(said["contacts"][0]["normal"].size(), 3U);
    arguments.query = CollideQuery::kImpact;
    arguments.tolerance = 1e-4;
    pose.start.translation = {4, 0, 0};
    pose.end = Pose{};
    said = nlohmann::json::parse(freeformAnswer(pair, pose, arguments, us));
    EXPECT_EQ(said["hit"], true);
    EXPECT_LE(said["t"], 0.5);
    EXPECT_GE(said["t"], 0.49997);
}

/// Patches that stand for a limit surface answer as the surface does, within what they say.
TEST_F(FreeformFiles, BezierPatchesAnswerAsTheSurfaceWithinTheirError) {
    const std::string path = file("cube.obj", cube(false));
    for (const double tolerance : {1e-2, 1e-4}) {
        CollideArguments arguments{.a = path, .b = path, .format = AnswerFormat::kJson};
        arguments.tolerance = tolerance;
        BezierFaces facesA, facesB;
        const Expected<FreeformShape> a =
            loadFreeform(path, FreeformKind::kBezier, Representation::kTriangles, arguments, &facesA);
        const Expected<FreeformShape> b =
            loadFreeform(path, FreeformKind::kBezier, Representation::kTriangles, arguments, &facesB);
        const Expected<FreeformShape> exact =
            loadFreeform(path, FreeformKind::kSubdivision, Representation::kTriangles, arguments);
        ASSERT_TRUE(a && b && exact);
        EXPECT_GT(facesA.error, 0);
        EXPECT_LE(facesA.error, 0.5 * tolerance);
        EXPECT_EQ(facesA.ptex.size(), a->faceCount());
        FreeformPair pair(*a, *b), truth(*exact, *exact);
        int met = 0, apart = 0;
        for (int i = 0; i < 40; ++i) {
            double us = 0;
            PoseLine pose;
            pose.start.translation = (0.6 + 0.05 * i) * Vec3d(std::cos(i), std::sin(i), 0.5 * std::cos(2 * i));
            pose.start.rotation = Quatd(Eigen::AngleAxisd(0.3 * i, Vec3d(1, 2, 3).normalized()));
            arguments.query = CollideQuery::kDistance;
            CollideArguments finely = arguments;
            finely.tolerance = 1e-6;
            const auto found = nlohmann::json::parse(freeformAnswer(pair, pose, arguments, us, facesA, facesB));
            const auto real = nlohmann::json::parse(freeformAnswer(truth, pose, finely, us));
            const double error = found["error"], distance = found["distance"];
            ASSERT_LE(error, 3 * tolerance);
            ASSERT_LE(std::abs(distance - real["distance"].get<double>()), error + 1e-6);
            ASSERT_LE(found["least"].get<double>(), real["distance"].get<double>() + 1e-12);
            for (int side = 0; side < 2; ++side) {
                ASSERT_LT(found["faces"][side], 6);
                ASSERT_GE(found["uv"][side][0], 0);
                ASSERT_LE(found["uv"][side][1], 1);
            }
            arguments.query = finely.query = CollideQuery::kAny;
            const auto touch = nlohmann::json::parse(freeformAnswer(pair, pose, arguments, us, facesA, facesB));
            const bool meets = nlohmann::json::parse(freeformAnswer(truth, pose, finely, us))["hit"];
            if (meets) {
                ASSERT_EQ(touch["hit"], true) << "what meets is never told apart";
            } else if (touch["hit"] == true) {
                ASSERT_LE(real["distance"].get<double>(), touch["error"].get<double>() + facesA.error + facesB.error);
            }
            (meets ? met : apart) += 1;
        }
        EXPECT_GT(met, 5);
        EXPECT_GT(apart, 5);
    }
}

/// Of two that are alike, one beside the other: by so much as they are wider than apart.
TEST_F(FreeformFiles, DepthIsTheWayOut) {
    const std::string path = file("cube.obj", cube(false));
    const auto shape = loadFreeformShape(path, FreeformKind::kSubdivision, Representation::kTriangles, {});
    ASSERT_TRUE(shape) << shape.error().message;
    const Affine3d here = Affine3d::Identity();
    const auto beside = [](double x) { return Affine3d(Eigen::Translation3d(x, 0, 0)); };
    QueryWork work;
    const double width = 9 - distanceInWorld({**shape, here}, {**shape, beside(9)}, {}, work).distance;
    ASSERT_GT(width, 1);
    for (const double x : {0.97 * width, 0.9 * width}) {
        const PairDepth depth = depthOf({**shape, here}, {**shape, beside(x)}, work);
        ASSERT_TRUE(depth.depth);
        EXPECT_GT(depth.normal.x(), 0.999);
        EXPECT_NEAR(*depth.depth, width - x, 1e-3);
        EXPECT_LT(depth.error, 1e-3);
    }
    EXPECT_EQ(depthOf({**shape, here}, {**shape, beside(1.01 * width)}, work).depth, 0.0);
}

TEST_F(FreeformFiles, BadOnesAreRefusedInWords) {
    const CollideArguments arguments;
    const auto refusal = [&](const std::string& path, FreeformKind kind) {
        const Expected<FreeformShape> shape = loadFreeform(path, kind, Representation::kTriangles, arguments);
        return shape ? std::string("accepted") : shape.error().message;
    };
    EXPECT_WORDS(refusal((folder_ / "none.obj").string(), FreeformKind::kNurbs));
    EXPECT_WORDS(refusal(folder_.string(), FreeformKind::kLoop));
    EXPECT_WORDS(refusal(file("quads.obj", cube(false)), FreeformKind::kLoop));
    EXPECT_WORDS(refusal(file("polygons.obj", cube(false)), FreeformKind::kNurbs));
    EXPECT_WORDS(refusal(file("bad.obj", "v 0 0 nan\nf 1 1 1\n"), FreeformKind::kSubdivision));
    EXPECT_WORDS(refusal(file("empty.obj", ""), FreeformKind::kSubdivision));
}

TEST_F(FreeformFiles, WhatIsLeftOutOfAMixedFileIsSaid) {
    const std::string surface =
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\ncstype bspline\ndeg 1 1\nsurf 0 1 0 1 1 2 3 4\nparm u 0 0 1 1\nparm v 0 0 "
        "1 1\nend\n";
    const auto said = [&](const std::string& text, FreeformKind kind) {
        testing::internal::CaptureStderr();
        EXPECT_TRUE(loadFreeform(file("mixed.obj", text), kind, Representation::kTriangles, CollideArguments()));
        return testing::internal::GetCapturedStderr();
    };
    EXPECT_WORDS(said(surface + "  f 1 2 4 3\n", FreeformKind::kNurbs));
    EXPECT_WORDS(said("f 1 2 4 3\n" + surface, FreeformKind::kSubdivision));
    EXPECT_EQ(said(surface + "# f 1 2 3\n", FreeformKind::kNurbs), "");
}

/// Queries look at the surface itself: it need not be one that can be drawn.
TEST_F(FreeformFiles, SurfacesThatTakeTooManyTrianglesAreTaken) {
    std::string text;
    constexpr int kAcross = 60;
    for (int j = 0; j < kAcross; ++j)
        for (int i = 0; i < kAcross; ++i)
            text += fmt::format("v {} {} {}\n", i * 0.01, (i * 7 + j * 11) % 13, j * 0.01);
    text += "cstype bspline\ndeg 3 3\nsurf 0 1 0 1";
    for (int k = 1; k <= kAcross * kAcross; ++k) text += fmt::format(" {}", k);
    for (const char* axis : {"u", "v"}) {
        text += fmt::format("\nparm {} 0 0 0", axis);
        for (int k = 0; k <= kAcross - 3; ++k) text += fmt::format(" {}", static_cast<double>(k) / (kAcross - 3));
        text += " 1 1 1";
    }
    const Expected<FreeformShape> shape = loadFreeform(file("spikes.obj", text + "\nend\n"), FreeformKind::kNurbs,
                                                       Representation::kTriangles, CollideArguments());
    EXPECT_TRUE(shape) << shape.error().message;
}

TEST_F(FreeformFiles, TrimsThatASceneRefusesAreRefused) {
    const std::string curve =
        "vp 0.2 0.2\nvp 0.8 0.2\nvp 0.5 0.8\nvp 0.2 0.2\ncstype bspline\ndeg 1\ncurv2 -4 -3 -2 -1\nparm u 0 0 1 2 3 "
        "3\nend\n";
    const std::string surface = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n" + curve + curve +
                                "deg 1 1\nsurf 0 1 0 1 1 2 3 4\nparm u 0 0 1 1\nparm v 0 0 1 1\ntrim 0 3 1\n";
    const CollideArguments arguments{.allowUnconfined = true};
    const auto load = [&](const std::string& text) {
        return loadFreeform(file("trimmed.obj", text), FreeformKind::kNurbs, Representation::kTriangles, arguments);
    };
    const Expected<FreeformShape> good = load(surface + "end\n"), same = load(surface + "hole 0 3 2\nend\n");
    EXPECT_TRUE(good) << good.error().message;
    ASSERT_FALSE(same);
    EXPECT_WORDS(same.error().message);
}

TEST_F(FreeformFiles, WordsThatDoNotGoTogether) {
    const auto parse = [](std::vector<std::string> more) {
        std::vector<std::string> words{"a.obj", "b.obj", "--poses", "p", "--as-a", "subdivision"};
        words.insert(words.end(), more.begin(), more.end());
        return parseCollideArguments(words);
    };
    const auto good = parse({"--query", "distance", "--as-b", "nurbs"});
    ASSERT_TRUE(good);
    EXPECT_EQ(std::get<CollideArguments>(*good).freeformA, FreeformKind::kSubdivision);
    EXPECT_EQ(std::get<CollideArguments>(*good).freeformB, FreeformKind::kNurbs);
    EXPECT_TRUE(parse({"--query", "any", "--as-b", "hull"}));
    EXPECT_TRUE(parse({"--query", "depth"}));
    EXPECT_FALSE(parse({"--query", "depth", "--as-b", "points"}));
    EXPECT_FALSE(parse({"--query", "any", "--as-b", "points"}));
    EXPECT_FALSE(parse({"--query", "any", "--threads", "2"}));
    EXPECT_FALSE(parse({"--query", "any", "--level-b", "3"}));
}

}  // namespace
}  // namespace tessera
