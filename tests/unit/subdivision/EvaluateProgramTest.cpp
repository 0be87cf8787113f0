/// tessera-evaluate as a process: a cube's limit surface, and a sphere's quarter that is trimmed.
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <vector>

#include "common/math/Types.h"
#include "tests/support/words/Words.h"

namespace tessera {
namespace {

struct EvaluateRun {
    int exitCode = -1;
    std::string output;
};

class EvaluateProgram : public testing::Test {
protected:
    EvaluateProgram() {
        std::string pattern = testing::TempDir() + "tessera-test-XXXXXX";
        folder_ = ::mkdtemp(pattern.data());
    }
    ~EvaluateProgram() override { std::filesystem::remove_all(folder_); }
    std::string write(const std::string& name, const std::string& text) {
        std::ofstream(folder_ / name) << text;
        return (folder_ / name).string();
    }
    static EvaluateRun run(const std::string& words) {
        EvaluateRun run;
        std::FILE* const pipe =
            ::popen((std::string("timeout 30 " TESSERA_BIN_DIR "/tessera-evaluate ") + words + " 2>&1").c_str(), "r");
        std::array<char, 4096> chunk{};
        while (const std::size_t got = std::fread(chunk.data(), 1, chunk.size(), pipe))
            run.output.append(chunk.data(), got);
        run.exitCode = WEXITSTATUS(::pclose(pipe));
        return run;
    }
    static Vec3d vectorIn(const nlohmann::json& numbers) {
        return Vec3d(numbers.at(0).get<double>(), numbers.at(1).get<double>(), numbers.at(2).get<double>());
    }
    std::filesystem::path folder_;
};

TEST_F(EvaluateProgram, ACubeByItsFaces) {
    const std::string cube =
        write("cube.obj",
              "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n"
              "f 5 6 7 8\nf 4 3 2 1\nf 1 2 6 5\nf 3 4 8 7\nf 2 3 7 6\nf 4 1 5 8\n");
    const EvaluateRun corner = run(cube + " --json --at " + write("corner", "0 0 0  # of +z\n"));
    ASSERT_EQ(corner.exitCode, 0) << corner.output;
    // (n² v + 4 Σe + Σd) / (n (n + 5)), n = 3: (9 v + 4 (-1 -1 1 + …) + …) / 24 is v · 1/2, of (-1, -1, 1).
    const nlohmann::json point = nlohmann::json::parse(corner.output);
    EXPECT_LT((vectorIn(point["point"]) - Vec3d(-0.5, -0.5, 0.5)).norm(), 1e-14) << corner.output;
    EXPECT_LT((vectorIn(point["normal"]) - Vec3d(-1, -1, 1).normalized()).norm(), 1e-12) << corner.output;
    EXPECT_EQ(point["error"], 0);
    const EvaluateRun none = run(cube + " --at " + write("none", "0 0.5 0.5\n6 0 0\n"));
    EXPECT_EQ(none.exitCode, 3);
    EXPECT_NE(none.output.find("none:2: "), std::string::npos) << none.output;
    EXPECT_NE(none.output.find("point 0 0 "), std::string::npos) << "the place before it is answered: " << none.output;
}

TEST_F(EvaluateProgram, ATrimmedQuarterOfACylinderByItsNumber) {
    // x² + z² = 1, y from 0 to 2; a hole around the middle.
    const std::string quarter =
        write("quarter.obj",
              "v 1 0 0 1\nv 1 0 1 0.70710678118654752\nv 0 0 1 1\nv 1 2 0 1\nv 1 2 1 0.70710678118654752\nv 0 2 1 1\n"
              "vp 0 0\nvp 1 0\nvp 1 2\nvp 0 2\nvp 0.4 0.8\nvp 0.6 0.8\nvp 0.6 1.2\nvp 0.4 1.2\n"
              "cstype bezier\ndeg 1\n"
              "curv2 1 2 3 4 1\nparm u 0 1 2 3 4\nend\ncurv2 5 8 7 6 5\nparm u 0 1 2 3 4\nend\n"
              "cstype rat bspline\ndeg 2 1\nsurf 0 1 0 2 1 2 3 4 5 6\nparm u 0 0 0 1 1 1\nparm v 0 0 2 2\ntrim 0 4 "
              "1\nhole 0 4 2\nend\n");
    const EvaluateRun good = run(quarter + " --scheme nurbs --json --at " + write("good", "0 0.2 0.5\n0 1 2\n"));
    ASSERT_EQ(good.exitCode, 0) << good.output;
    const nlohmann::json point = nlohmann::json::parse(good.output.substr(0, good.output.find('\n')));
    const Vec3d p = vectorIn(point["point"]), normal = vectorIn(point["normal"]);
    EXPECT_NEAR(std::hypot(p.x(), p.z()), 1, 1e-14);
    EXPECT_NEAR(p.y(), 0.5, 1e-14);
    EXPECT_NEAR(std::abs(normal.dot(Vec3d(p.x(), 0, p.z()))), 1, 1e-12);
    for (const char* const place : {"0 0.5 1", "1 0 0", "0 1.5 0", "0 nan 0"}) {
        const EvaluateRun bad = run(quarter + " --scheme nurbs --at " + write("bad", place));
        EXPECT_EQ(bad.exitCode, 3) << place;
        EXPECT_WORDS(bad.output);
    }
    EXPECT_EQ(run(quarter + " --scheme nurb --at x").exitCode, 2);
}

/// By Bézier patches near the limit surface: beside many of its points, evaluated.
TEST_F(EvaluateProgram, TheNearestPointOfASubdivisionSurfaceWithItsError) {
    const std::string cube =
        write("cube.obj",
              "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n"
              "f 5 6 7 8\nf 4 3 2 1\nf 1 2 6 5\nf 3 4 8 7\nf 2 3 7 6\nf 4 1 5 8\n");
    std::string grid;
    constexpr int kSteps = 40;
    for (int face = 0; face < 6; ++face)
        for (int i = 0; i <= kSteps; ++i)
            for (int j = 0; j <= kSteps; ++j)
                grid += std::to_string(face) + " " + std::to_string(double(i) / kSteps) + " " +
                        std::to_string(double(j) / kSteps) + "\n";
    const EvaluateRun sampled = run(cube + " --json --at " + write("grid", grid));
    ASSERT_EQ(sampled.exitCode, 0);
    std::vector<Vec3d> points;
    std::istringstream lines(sampled.output);
    for (std::string line; std::getline(lines, line);) points.push_back(vectorIn(nlohmann::json::parse(line)["point"]));
    const Vec3d places[] = {{2, 0.3, -0.1}, {0.9, 0.9, 0.9}, {0.1, 0.2, 0.3}, {-0.4, -3, 0.2}, {1, 1, -1}};
    std::string asked;
    for (const Vec3d& p : places)
        asked += std::to_string(p.x()) + " " + std::to_string(p.y()) + " " + std::to_string(p.z()) + "\n";
    for (const double tolerance : {1e-2, 1e-4}) {
        const EvaluateRun near =
            run(cube + " --json --tolerance " + std::to_string(tolerance) + " --nearest " + write("near", asked));
        ASSERT_EQ(near.exitCode, 0) << near.output;
        std::istringstream answers(near.output);
        for (const Vec3d& place : places) {
            std::string line;
            ASSERT_TRUE(std::getline(answers, line));
            const nlohmann::json said = nlohmann::json::parse(line);
            double least = 1e9;
            for (const Vec3d& p : points) least = std::min(least, (p - place).norm());
            const double distance = said["distance"], error = said["error"];
            EXPECT_LE(error, tolerance * 1.01) << line;
            EXPECT_LE(distance - error, least + 1e-12) << line;
            EXPECT_GE(distance + error, least - 0.02) << "samples are 0.02 apart: " << line;
            EXPECT_NEAR((vectorIn(said["point"]) - place).norm(), distance, 1e-12);
            // The parameters are the surface's own.
            const EvaluateRun there = run(cube + " --json --at " +
                                          write("there", std::to_string(said["face"].get<int>()) + " " +
                                                             said["u"].dump() + " " + said["v"].dump() + "\n"));
            ASSERT_EQ(there.exitCode, 0) << there.output;
            EXPECT_LE((vectorIn(nlohmann::json::parse(there.output)["point"]) - vectorIn(said["point"])).norm(),
                      tolerance)
                << line;
        }
    }
    const EvaluateRun loop =
        run(write("tetra.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n") +
            " --scheme loop --nearest " + write("near", "0 0 0\n"));
    EXPECT_EQ(loop.exitCode, 1) << loop.output;
    EXPECT_WORDS(loop.output);
}

TEST_F(EvaluateProgram, TheNearestPointOfATrimmedSurface) {
    const std::string square = write("square.obj",
                                     "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvp 0.25 0.25\nvp 0.75 0.25\nvp 0.75 0.75\nvp "
                                     "0.25 0.75\ncstype bezier\ndeg 1\n"
                                     "curv2 1 4 3 2 1\nparm u 0 1 2 3 4\nend\ndeg 1 1\nsurf 0 1 0 1 1 2 3 4\nparm u 0 "
                                     "1\nparm v 0 1\nhole 0 4 1\nend\n");
    const EvaluateRun found =
        run(square + " --scheme nurbs --json --tolerance 1e-5 --nearest " + write("near", "0.125 0.5 2\n0.45 0.5 0\n"));
    ASSERT_EQ(found.exitCode, 0) << found.output;
    const nlohmann::json above = nlohmann::json::parse(found.output.substr(0, found.output.find('\n')));
    EXPECT_NEAR(above["distance"], 2, 1e-9);
    EXPECT_NEAR(above["u"], 0.125, 1e-4);
    const nlohmann::json hole = nlohmann::json::parse(found.output.substr(found.output.find('\n') + 1));
    EXPECT_NEAR(hole["distance"], 0.2, 1e-3) << "to the trimming curve";
}

}  // namespace
}  // namespace tessera
