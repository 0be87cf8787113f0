// tessera-collide as people and scripts meet it: a process, files, lines. Its answers are those of brute force over the
// triangles of the files.
#include <fmt/format.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <random>

#include "server/collision/mesh/TriangleContact.h"
#include "server/collision/query/TimeOfImpact.h"
#include "tests/truth/RealPairs.h"
#include "tests/unit/TestFolder.h"
#include "tests/unit/collision/BruteForce.h"

namespace tessera {
namespace {

using nlohmann::json;

struct Outcome {
    int exitCode = -1;
    std::string out, err;
    [[nodiscard]] std::vector<std::string> lines() const {
        std::vector<std::string> all;
        std::istringstream in(out);
        for (std::string line; std::getline(in, line);) all.push_back(line);
        return all;
    }
};

class CollideProgram : public testing::Test {
protected:
    /// Words are put into single quotes; `environment` goes before them.
    Outcome run(const std::vector<std::string>& words, const std::string& environment = "") {
        std::string command = environment + " '" TESSERA_BIN_DIR "/tessera-collide'";
        for (const std::string& word : words) command += " '" + word + "'";
        const std::string errors = folder_ / "stderr";
        std::FILE* pipe = ::popen((command + " 2>'" + errors + "'").c_str(), "r");
        Outcome outcome;
        std::array<char, 4096> chunk{};
        for (std::size_t got; (got = std::fread(chunk.data(), 1, chunk.size(), pipe)) > 0;)
            outcome.out.append(chunk.data(), got);
        const int status = ::pclose(pipe);
        outcome.exitCode = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
        std::ifstream in(errors);
        outcome.err.assign(std::istreambuf_iterator<char>(in), {});
        return outcome;
    }
    Outcome ask(const std::string& a, const std::string& b, const std::string& poses, const std::string& query,
                std::vector<std::string> more = {"--json"}, const std::string& environment = "") {
        std::vector<std::string> words{a, b, "--poses", poses, "--query", query, "--allow-unconfined-import"};
        words.insert(words.end(), more.begin(), more.end());
        return run(words, environment);
    }
    std::string write(const std::string& name, const std::string& text) {
        const std::string path = folder_ / name;
        std::ofstream(path) << text;
        return path;
    }
    test::TestFolder folder_;
};

/// Two small models, in their own units, far from each other in size.
class CollideFiles : public CollideProgram {
protected:
    void SetUp() override {
        a = (testDataFolder() / "meshes/spot/spot_control_mesh.obj").string();
        b = (testDataFolder() / "meshes/fish/fish_control_mesh.obj").string();
        if (!std::filesystem::exists(a) || !std::filesystem::exists(b))
            GTEST_SKIP() << "no test data at " << testDataFolder() << " (set TESSERA_TEST_DATA)";
        meshA = readByHand(a);
        meshB = readByHand(b);
    }

    /// v and f lines, polygons fanned, and nothing of the importer.
    static TriangleMesh readByHand(const std::string& path) {
        std::ifstream in(path);
        MeshArrays3 arrays;
        std::string line, word;
        while (std::getline(in, line)) {
            std::istringstream words(line);
            words >> word;
            if (word == "v") {
                for (float x; words >> x;) arrays.positions.push_back(x);
            } else if (word == "f") {
                std::vector<std::uint32_t> corners;
                while (words >> word) corners.push_back(static_cast<std::uint32_t>(std::stoul(word) - 1));
                for (std::size_t i = 2; i < corners.size(); ++i)
                    arrays.indices.insert(arrays.indices.end(), {corners[0], corners[i - 1], corners[i]});
            }
            word.clear();
        }
        return meshOf(arrays);
    }

    static std::string text(const Pose& p) {
        std::ostringstream out;
        out.precision(17);
        out << p.translation.x() << " " << p.translation.y() << " " << p.translation.z() << " " << p.rotation.w() << " "
            << p.rotation.x() << " " << p.rotation.y() << " " << p.rotation.z();
        return out.str();
    }

    /// B's middle somewhere about A's.
    Pose randomPose(std::mt19937& random, double from, double to) const {
        std::normal_distribution<double> n;
        const Vec3d d = Vec3d(n(random), n(random), n(random)).normalized();
        const double reach = 0.5 * (meshA.bounds().size().norm() + meshB.bounds().size().norm());
        Pose pose;
        pose.rotation = Quatd(n(random), n(random), n(random), n(random)).normalized();
        pose.translation = meshA.bounds().center() - pose.rotation * meshB.bounds().center() +
                           std::uniform_real_distribution<double>(from, to)(random) * reach * d;
        return pose;
    }

    std::string a, b;
    TriangleMesh meshA, meshB;
};

TEST_F(CollideFiles, FindThePairsThatBruteForceFinds) {
    std::mt19937 random(5);
    std::string file = "# seven numbers each\n";
    std::vector<std::vector<FacePair>> truth;
    for (int i = 0; i < 60; ++i) {
        const Pose pose = randomPose(random, 0, 1);
        file += text(pose) + "\n";
        truth.push_back(bruteForce(meshA, meshB, pose.matrix()));
    }
    const std::string poses = write("some.poses", file);
    const Outcome all = ask(a, b, poses, "all"), any = ask(a, b, poses, "any");
    ASSERT_EQ(all.exitCode, 0) << all.err;
    ASSERT_EQ(any.exitCode, 0) << any.err;
    const auto allLines = all.lines(), anyLines = any.lines();
    ASSERT_EQ(allLines.size(), truth.size());
    ASSERT_EQ(anyLines.size(), truth.size());
    int hits = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
        const json answer = json::parse(allLines[i]);
        json first = json::array();
        for (std::size_t p = 0; p < std::min<std::size_t>(16, truth[i].size()); ++p)
            first.push_back({truth[i][p].a, truth[i][p].b});
        EXPECT_EQ(answer, json({{"hit", !truth[i].empty()}, {"pairs", truth[i].size()}, {"first", first}})) << i;
        EXPECT_EQ(json::parse(anyLines[i]), json({{"hit", !truth[i].empty()}})) << i;
        hits += !truth[i].empty();
    }
    EXPECT_GT(hits, 10);
    EXPECT_LT(hits, 55);
}

TEST_F(CollideFiles, AnswerTheSameBytesWithAnyInstructionSetTreeAndNumberOfThreads) {
    std::mt19937 random(6);
    std::string poses, motions;
    for (int i = 0; i < 20; ++i) {
        poses += text(randomPose(random, 0, 1)) + "\n";
        motions += text(randomPose(random, 0.9, 1.5)) + " " + text(randomPose(random, 0, 0.8)) + "\n";
    }
    const std::string poseFile = write("some.poses", poses), motionFile = write("some.motions", motions);
    for (const std::string query : {"any", "all", "distance", "toi"}) {
        const std::string& file = query == "toi" ? motionFile : poseFile;
        // The volumes decide how far within the tolerance a search for a contact stops, and spheres and oriented boxes
        // are fitted with roundings of the instruction set's own: toi says the same with the others.
        const std::vector<std::string> more = query == "toi" ? std::vector<std::string>{"--json", "--volume", "dop18"}
                                                             : std::vector<std::string>{"--json"};
        const Outcome plain = ask(a, b, file, query, more);
        ASSERT_EQ(plain.exitCode, 0) << plain.err;
        for (const char* set : {"sse41", "avx2", "avx512"})
            EXPECT_EQ(ask(a, b, file, query, more, std::string("TESSERA_ISA=") + set).out, plain.out) << query << set;
        // Of faces equally near any may be named; which one is up to the tree.
        if (query != "any" && query != "all") continue;
        EXPECT_EQ(ask(a, b, file, query, {"--json", "--threads", "3"}).out, plain.out) << query;
        for (const char* volume : {"sphere", "aabb", "obb", "dop6", "dop14", "dop18", "dop26"})
            EXPECT_EQ(ask(a, b, file, query, {"--json", "--volume", volume}).out, plain.out) << query << volume;
        for (const char* split : {"area", "median", "mean", "volume"})
            EXPECT_EQ(ask(a, b, file, query, {"--json", "--split", split}).out, plain.out) << query << split;
    }
}

TEST_F(CollideFiles, RealignmentChangesTheBoxesAndNoAnswer) {
    std::mt19937 random(8);
    std::string poses;
    for (int i = 0; i < 40; ++i) poses += text(randomPose(random, 0, 1)) + "\n";
    const std::string file = write("some.poses", poses);
    int countsThatDiffer = 0;
    for (const std::string query : {"any", "all"}) {
        const Outcome plain = ask(a, b, file, query);
        ASSERT_EQ(plain.exitCode, 0) << plain.err;
        for (const char* volume : {"dop14", "dop18", "dop26"}) {
            std::map<std::string, json> times;
            for (const std::string realignment : {"planes", "table"}) {
                const Outcome outcome =
                    ask(a, b, file, query, {"--json", "--time", "--volume", volume, "--realignment", realignment});
                ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
                const std::size_t last = outcome.out.rfind("{\"build_us\"");
                ASSERT_NE(last, std::string::npos);
                EXPECT_EQ(outcome.out.substr(0, last), plain.out) << query << volume << realignment;
                times[realignment] = json::parse(outcome.out.substr(last));
                EXPECT_GT(times[realignment]["boxes_tested"], 100);
                EXPECT_GT(times[realignment]["box_volume"], 0);
            }
            // Of few boxes as many may be tested by chance.
            countsThatDiffer += times["planes"]["boxes_tested"] != times["table"]["boxes_tested"];
            EXPECT_NE(times["planes"]["box_volume"], times["table"]["box_volume"]) << query << volume;
        }
    }
    EXPECT_GT(countsThatDiffer, 0);
    EXPECT_EQ(ask(a, b, file, "all", {"--json", "--realignment", "table"}).out, ask(a, b, file, "all").out)
        << "dop18, where nothing is said";
}

TEST_F(CollideProgram, SphericalBezierPatchesAnswerAsTriangles) {
    const auto boxAt = [](double x, int from) {
        std::string text;
        for (int i = 0; i < 8; ++i) text += fmt::format("v {} {} {}\n", x + (i & 1), i >> 1 & 1, i >> 2);
        for (const char* f : {"1 3 4 2", "5 6 8 7", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6"}) {
            std::istringstream corners(f);
            text += "f";
            for (int c; corners >> c;) text += fmt::format(" {}", from + c);
            text += "\n";
        }
        return text;
    };
    const std::string box = write("box.obj", boxAt(0, 0));
    // No place sees all faces of two.
    const std::string two = write("two.obj", boxAt(0, 0) + boxAt(1.5, 8));
    const std::string poses = write(
        "some.poses", "0.5 0 0 1 0 0 0\n2.5 0 0 1 0 0 0\n1 1 1 1 0 0 0\n1.2 0.1 0 0.9 0.1 0.3 -0.2\n0 0 0 1 0 0 0\n");
    for (const std::string query : {"any", "all", "distance", "depth"})
        for (const std::string& other : {box, two}) {
            const Outcome plain = ask(box, other, poses, query),
                          found = ask(box, other, poses, query, {"--json", "--as-a", "spherical-bezier"}),
                          both = ask(other, box, poses, query,
                                     {"--json", "--as-a", "spherical-bezier", "--as-b", "spherical-bezier"});
            ASSERT_EQ(found.exitCode, 0) << found.err;
            EXPECT_EQ(found.out, plain.out) << query;
            EXPECT_EQ(found.err, "");
            ASSERT_EQ(both.exitCode, 0) << both.err;
            EXPECT_EQ(both.out, ask(other, box, poses, query).out) << query;
            EXPECT_EQ(both.err.find("two.obj: it is not star-shaped") != std::string::npos, other == two) << both.err;
            EXPECT_EQ(both.err.find("taken as triangles") != std::string::npos, other == two) << both.err;
        }
}

TEST_F(CollideProgram, RaysNameTheNodeThatTheyMeetFirst) {
    const std::string scene =
        write("scene.tsct",
              "node { name: \"near\" transform { translation { x: 2 } } box { size { x: 1 y: 1 z: 1 } } }\n"
              "node { name: \"far\" transform { translation { x: 5 } } sphere { radius: 1 } }\n");
    const std::string rays = write("rays", "0 0.1 0.2 2 0 0\n9 0 0 -1 0 0  # from behind\n0 3 0 1 0 0\n");
    const Outcome outcome = run({scene, "--query", "ray", "--poses", rays, "--json", "--allow-unconfined-import"});
    ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
    const auto lines = outcome.lines();
    ASSERT_EQ(lines.size(), 3u);
    const json near = json::parse(lines[0]), far = json::parse(lines[1]);
    EXPECT_EQ(near["node"], "/near/geometry");
    EXPECT_NEAR(near["t"].get<double>(), 0.75, 1e-12);
    EXPECT_NEAR(near["normal"][0].get<double>(), -1, 1e-12);
    EXPECT_NEAR(near["point"][1].get<double>(), 0.1, 1e-12);
    EXPECT_EQ(far["node"], "/far/geometry");
    EXPECT_NEAR(far["t"].get<double>(), 3, 0.02);
    EXPECT_EQ(json::parse(lines[2]), json({{"hit", false}}));
    const Outcome words = run({scene, "--query", "ray", "--poses", rays, "--allow-unconfined-import"});
    EXPECT_NE(words.out.find("/near/geometry at t = 0.75, face "), std::string::npos) << words.out;
    EXPECT_NE(words.out.find("meets nothing"), std::string::npos);
    const Outcome bad =
        run({scene, "--query", "ray", "--poses", write("bad", "0 0 0 0 0 0\n"), "--allow-unconfined-import"});
    EXPECT_EQ(bad.exitCode, 3);
    EXPECT_NE(bad.err.find("bad:1: the ray has no direction"), std::string::npos) << bad.err;
}

TEST_F(CollideFiles, MeetNeverAfterTheFirstContactAndWithinTheTolerance) {
    const double tolerance = 1e-3;
    std::mt19937 random(7);
    std::string file;
    std::vector<BodyMotion> motions;
    for (int i = 0; i < 30; ++i) {
        motions.push_back({randomPose(random, 0.8, 1.5), randomPose(random, 0, 1.2)});
        file += text(motions.back().start) + " " + text(motions.back().end) + "\n";
    }
    const Outcome outcome = ask(a, b, write("some.motions", file), "toi", {"--json", "--tolerance", "1e-3"});
    ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
    const auto lines = outcome.lines();
    ASSERT_EQ(lines.size(), motions.size());
    int hits = 0;
    for (std::size_t i = 0; i < motions.size(); ++i) {
        SCOPED_TRACE(i);
        const json answer = json::parse(lines[i]);
        const bool hit = answer["hit"];
        const double until = hit ? answer["t"].get<double>() : 1.0;
        // No sample before is in contact.
        constexpr int kSamples = 400;
        for (int s = 0; s < kSamples; ++s) {
            const Affine3d at = motions[i].at(until * s / kSamples).matrix();
            ASSERT_TRUE(bruteForce(meshA, meshB, at).empty()) << "in contact at sample " << s;
        }
        if (!hit) continue;
        ++hits;
        const Affine3d at = motions[i].at(until).matrix();
        double least = bruteForce(meshA, meshB, at).empty() ? 1e300 : 0;
        for (std::uint32_t f = 0; f < meshA.faceCount() && least > 0; ++f)
            for (std::uint32_t g = 0; g < meshB.faceCount(); ++g)
                least = std::min(least, nearestPoints(meshA.triangle(f), transformed(at, meshB.triangle(g))).distance);
        EXPECT_LE(least, tolerance);
        EXPECT_NEAR(answer["distance"].get<double>(), least, 1e-12);
        EXPECT_LT(answer["faces"][0].get<std::size_t>(), meshA.faceCount());
        EXPECT_LT(answer["faces"][1].get<std::size_t>(), meshB.faceCount());
        const auto normal = answer["normal"].get<std::vector<double>>();
        EXPECT_NEAR(Vec3d(normal[0], normal[1], normal[2]).norm(), 1, 1e-9);
    }
    EXPECT_GT(hits, 10);
}

TEST_F(CollideFiles, TakeTheirTimesWhereAsked) {
    const std::string poses = write("one.poses", "0 0 0 1 0 0 0\n0 0 99 1 0 0 0\n");
    const Outcome outcome = ask(a, b, poses, "any", {"--json", "--time"});
    ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
    const auto lines = outcome.lines();
    ASSERT_EQ(lines.size(), 3u);
    const json times = json::parse(lines.back());
    for (const char* key : {"build_us", "mean_us", "median_us", "p99_us"})
        EXPECT_GT(times[key].get<double>(), 0) << key;
    EXPECT_EQ(times["threads"], 1);
    EXPECT_FALSE(times["instruction_set"].get<std::string>().empty());
    const Outcome plain = ask(a, b, poses, "any", {"--time"});
    ASSERT_EQ(plain.lines().size(), 3u);
    EXPECT_EQ(plain.lines()[1], "do not touch");
}

TEST_F(CollideProgram, SaysWhatIsWrongWithItsInput) {
    const std::string model = write("one.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    const std::string good = write("good.poses", "0 0 0 1 0 0 0\n"), bad = write("bad.poses", "0 0 0 1 0 0 0\n1 2\n");
    const struct {
        std::vector<std::string> words;
        int exitCode;
        std::string says;
    } cases[] = {
        {{model, model, "--poses", bad, "--query", "any"}, 3, "bad.poses:2: 2 numbers"},
        {{model, model, "--poses", good, "--query", "toi"}, 3, "good.poses:1: 7 numbers"},
        {{model, model, "--poses", folder_ / "no.poses", "--query", "any"}, 3, "no.poses"},
        {{model, folder_ / "no.obj", "--poses", good, "--query", "any"}, 3, "no.obj"},
        {{model, good, "--poses", good, "--query", "any"}, 1, "good.poses"},
        {{model, model, "--poses", good}, 2, "--query"},
        {{model, model, "--poses", good, "--query", "toi", "--tolerance", "0"}, 2, "--tolerance"},
    };
    for (const auto& c : cases) {
        std::vector<std::string> words = c.words;
        words.push_back("--allow-unconfined-import");
        const Outcome outcome = run(words);
        EXPECT_EQ(outcome.exitCode, c.exitCode) << c.says << ": " << outcome.err;
        EXPECT_EQ(outcome.out, "") << c.says;
        EXPECT_EQ(outcome.err.rfind("tessera-collide: ", 0), 0u) << outcome.err;
        EXPECT_NE(outcome.err.find(c.says), std::string::npos) << outcome.err;
        EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    }
}

TEST_F(CollideProgram, SaysThatAFileMayBeCut) {
    const std::string model = write("one.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3"),
                      poses = write("good.poses", "0 0 0 1 0 0 0\n");
    const Outcome outcome = ask(model, model, poses, "any");
    EXPECT_EQ(outcome.exitCode, 0) << outcome.err;
    EXPECT_EQ(outcome.out, "{\"hit\":true}\n");
    EXPECT_NE(outcome.err.find("one.obj: its last line (line 4) has no line break: its last number may be cut off"),
              std::string::npos)
        << outcome.err;
}

TEST_F(CollideProgram, AnswersNothingToNoPoses) {
    const std::string model = write("one.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    const Outcome outcome = ask(model, model, write("none.poses", "# none\n"), "all");
    EXPECT_EQ(outcome.exitCode, 0) << outcome.err;
    EXPECT_EQ(outcome.out, "");
}

TEST_F(CollideProgram, TouchingCountsAndCoplanarOverlapCounts) {
    const std::string model = write("one.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    const std::string poses = write("edge.poses",
                                    "1 0 0 1 0 0 0\n"             // corner on corner
                                    "0.25 0.25 0 1 0 0 0\n"       // in one plane, overlapping
                                    "0.25 0.25 1e-300 1 0 0 0\n"  // not quite in one plane
                                    "1.0000000000000002 0 0 1 0 0 0\n");
    const Outcome outcome = ask(model, model, poses, "all");
    ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
    EXPECT_EQ(outcome.out,
              "{\"hit\":true,\"pairs\":1,\"first\":[[0,0]]}\n{\"hit\":true,\"pairs\":1,\"first\":[[0,0]]}\n"
              "{\"hit\":false,\"pairs\":0,\"first\":[]}\n{\"hit\":false,\"pairs\":0,\"first\":[]}\n");
}

}  // namespace
}  // namespace tessera
