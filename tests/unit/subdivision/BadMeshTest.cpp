/// What is no control mesh is refused in words, whoever says it: an application, or a file.
#include <gtest/gtest.h>

#include <cmath>

#include "common/freeform/subdivision/LimitEvaluator.h"
#include "common/math/Box.h"
#include "server/tools/evaluate/EvaluateCommand.h"
#include "server/tools/evaluate/ObjControlMesh.h"
#include "tests/unit/subdivision/SomeMesh.h"

namespace tessera {
namespace {

using test::Seeds;

std::string refusalOf(const ControlMesh& mesh) {
    const auto topology = SubdivisionTopology::build(mesh);
    return topology ? "taken" : topology.error().message;
}

TEST(BadMesh, IsRefusedByName) {
    const ControlMesh good = test::gridMesh(2, 2, false, SubdivisionScheme::kCatmullClark);
    EXPECT_EQ(refusalOf(good), "taken");
    EXPECT_EQ(refusalOf({}), "there are no faces");
    ControlMesh m = good;
    m.positions[3].y() = std::nan("");
    EXPECT_EQ(refusalOf(m), "vertex 3 has a coordinate that is not a number within 1e100");
    m = good;
    m.faceVertices[5] = 9;
    EXPECT_EQ(refusalOf(m), "face 1 names vertex 9, and there are 9");
    m = good;
    m.faceSizes[0] = 2;
    EXPECT_EQ(refusalOf(m), "face 0 has fewer than three vertices");
    m = good;
    m.faceSizes[3] = 5;
    EXPECT_EQ(refusalOf(m), "face 3 has more vertices than are listed");
    m = good;
    m.faceVertices.push_back(0);
    EXPECT_EQ(refusalOf(m), "17 corners of faces are listed, and the faces have 16");
    m = good;
    m.faceVertices[2] = m.faceVertices[0];
    EXPECT_EQ(refusalOf(m), "face 0 has vertex 0 twice");
    m = good;
    m.scheme = SubdivisionScheme::kLoop;
    EXPECT_EQ(refusalOf(m), "face 0 is no triangle, and Loop's scheme takes nothing else");
    m = good;
    m.creases.push_back({0, 8, 2});
    EXPECT_EQ(refusalOf(m), "the crease 0 8 is along no edge of any face");
    m = good;
    m.creases.push_back({0, 1, std::nanf("")});
    EXPECT_EQ(refusalOf(m), "the crease 0 1 has a sharpness that is not a number");
    m = good;
    m.corners.push_back({70, 1});
    EXPECT_EQ(refusalOf(m), "the corner at vertex 70: there are 9 vertices");
    m = good;
    m.holes.push_back(4);
    EXPECT_EQ(refusalOf(m), "the hole 4: there are 4 faces");
    EXPECT_EQ(refusalOf(test::poleMesh(5000, SubdivisionScheme::kLoop)), "vertex 0 has more than 4096 edges");
}

TEST(BadMesh, AnyIndicesAreRefusedOrEvaluated) {
    // Faces of random vertices: edges of many faces, fans that touch, faces on top of each other.
    const Seeds seeds(3000);
    std::size_t taken = 0, points = 0;
    for (std::uint64_t seed = seeds.first; seed < seeds.first + seeds.count; ++seed) {
        TESSERA_TRACE_SEED("unit_subdivision", seed);
        std::mt19937_64 random(seed);
        const auto pick = [&](std::uint32_t n) { return static_cast<std::uint32_t>(random() % n); };
        ControlMesh mesh{.scheme = static_cast<SubdivisionScheme>(pick(3)),
                         .boundary = static_cast<BoundaryInterpolation>(pick(3)),
                         .creaseMethod = static_cast<CreaseMethod>(pick(2)),
                         .triangles = static_cast<TriangleRule>(pick(2))};
        const std::uint32_t count = 4 + pick(8), faces = 1 + pick(8);
        for (std::uint32_t i = 0; i < count; ++i)
            mesh.positions.emplace_back(pick(100) / 10.0, pick(100) / 10.0, pick(100) / 10.0);
        for (std::uint32_t f = 0; f < faces; ++f) {
            const std::uint32_t size = mesh.scheme == SubdivisionScheme::kLoop ? 3 : 3 + pick(4);
            mesh.faceSizes.push_back(size);
            std::set<std::uint32_t> used;
            for (std::uint32_t i = 0; i < size; ++i) {
                std::uint32_t v = pick(count);
                while (pick(20) != 0 && used.contains(v) && used.size() < count) v = pick(count);
                used.insert(v);
                mesh.faceVertices.push_back(v);
            }
        }
        if (pick(2) == 0)
            mesh.creases.push_back({mesh.faceVertices[0], mesh.faceVertices[1], static_cast<float>(pick(12))});
        if (pick(2) == 0) mesh.corners.push_back({pick(count), static_cast<float>(pick(12))});
        const auto topology = SubdivisionTopology::build(mesh);
        if (!topology) {
            EXPECT_FALSE(topology.error().message.empty());
            continue;
        }
        ++taken;
        LimitEvaluator evaluator(*topology);
        Box box;
        for (const Vec3d& p : mesh.positions) box.extend(p);
        for (std::uint32_t f = 0; f < topology->ptexFaceCount(); ++f) {
            for (const auto& [u, v] : {std::pair(0.0, 0.0), std::pair(1e-7, 0.3), test::somePlace(random, true)}) {
                const auto point = evaluator.evaluate(mesh.positions, {f, u, v});
                if (!point) continue;
                ++points;
                ASSERT_TRUE(point->point.allFinite() && point->du.allFinite() && point->dv.allFinite() &&
                            point->normal.allFinite());
                // In the hull of the control points, so in their box.
                EXPECT_LE((point->point - point->point.cwiseMax(box.lower).cwiseMin(box.upper)).norm(), 1e-12)
                    << f << " " << u << " " << v;
            }
        }
    }
    if (seeds.count > 1) {
        EXPECT_GT(taken, seeds.count / 2);
        EXPECT_GT(points, seeds.count * 5);
    }
}

std::string objRefusal(std::string_view text) {
    const auto obj = parseObjControlMesh(text, "a.obj", SubdivisionScheme::kCatmullClark);
    return obj ? "taken" : obj.error().message;
}

TEST(ObjControlMesh, ReadsFacesAndTags) {
    const auto obj = parseObjControlMesh(
        "# a\nv 0 0 0\r\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv +2 0 .5\nv 2 1 0 1\nvt 0 0\nf 1/1/1 2 3//3 4\nf -5 -2 -1 -4\n"
        "t crease 2/1/0 1 2 2.5\nt crease 4/2/0 0 1 1 2 1.5 10\nt corner 2/1/0 0 3 3\nt hole 1/0/0 1\nt "
        "interpolateboundary 1/0/0 1\n"
        "t creasemethod 0/0/1 chaikin\nt smoothtriangles 0/0/1 smooth\nt vertexedit 1/0/0\n#t corner 1/1/0 99 1\n",
        "a.obj", SubdivisionScheme::kCatmullClark);
    ASSERT_TRUE(obj.has_value()) << obj.error().message;
    const ControlMesh& mesh = obj->mesh;
    EXPECT_EQ(mesh.faceSizes, (std::vector<std::uint32_t>{4, 4}));
    EXPECT_EQ(mesh.faceVertices, (std::vector<std::uint32_t>{0, 1, 2, 3, 1, 4, 5, 2}));
    ASSERT_EQ(mesh.creases.size(), 3U);
    EXPECT_EQ(mesh.creases[0].sharpness, 2.5F);
    EXPECT_EQ(mesh.creases[2].from, 1U);
    EXPECT_EQ(mesh.creases[2].sharpness, 10.0F);
    ASSERT_EQ(mesh.corners.size(), 2U);
    EXPECT_EQ(mesh.corners[1].vertex, 3U);
    EXPECT_EQ(mesh.holes, std::vector<std::uint32_t>{1});
    EXPECT_EQ(mesh.boundary, BoundaryInterpolation::kEdgeAndCorner);
    EXPECT_EQ(mesh.creaseMethod, CreaseMethod::kChaikin);
    EXPECT_EQ(mesh.triangles, TriangleRule::kSmooth);
    EXPECT_EQ(obj->notes, std::vector<std::string>{"the tag 'vertexedit' is passed over"});
    EXPECT_EQ(mesh.positions[4], Vec3d(2, 0, 0.5));
}

TEST(ObjControlMesh, RefusesByFileAndLine) {
    EXPECT_EQ(objRefusal(""), "a.obj: there are no faces");
    EXPECT_EQ(objRefusal("v 0 0"), "a.obj:1: a vertex needs three coordinates");
    EXPECT_EQ(objRefusal("\nv 0 0 x"), "a.obj:2: 'x' is no number");
    EXPECT_EQ(objRefusal("v 0 0 inf"), "a.obj:1: a coordinate is not finite");
    EXPECT_EQ(objRefusal("f 1 2"), "a.obj:1: a face needs three vertices or more");
    EXPECT_EQ(objRefusal("f 1 0 2"), "a.obj:1: '0' is no number of a vertex");
    EXPECT_EQ(objRefusal("f 1 -1 2"), "a.obj:1: there is no vertex -1");
    EXPECT_EQ(objRefusal("f 1 99999999999 2"), "a.obj:1: there is no vertex 99999999999");
    EXPECT_EQ(objRefusal("t crease 2 0 1 3"), "a.obj:1: a tag needs its counts as INTS/FLOATS/STRINGS after its name");
    EXPECT_EQ(objRefusal("t crease 2/1/0 0 1"), "a.obj:1: the tag 'crease' has fewer values than it says");
    EXPECT_EQ(objRefusal("t crease 4000000000/1/0 0 1"), "a.obj:1: the tag 'crease' has fewer values than it says");
    EXPECT_EQ(objRefusal("t crease 3/1/0 0 1 2 1"), "a.obj:1: a crease needs pairs of vertices");
    EXPECT_EQ(objRefusal("t interpolateboundary 1/0/0 3"),
              "a.obj:1: interpolateboundary is 0 (none), 1 (edges and corners) or 2 (edges)");
}

TEST(ObjControlMesh, NoBytesCrashIt) {
    const std::string good =
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1/1/1 2 3//3 4\nt crease 2/1/0 1 2 2.5\nt corner 1/1/0 0 3\nt hole "
        "1/0/0 0\nt creasemethod 0/0/1 chaikin\n";
    const Seeds seeds(5000);
    std::size_t taken = 0;
    for (std::uint64_t seed = seeds.first; seed < seeds.first + seeds.count; ++seed) {
        TESSERA_TRACE_SEED("unit_subdivision", seed);
        std::mt19937_64 random(seed);
        std::string text = good;
        for (std::uint64_t i = random() % 8; i > 0; --i) {
            const std::size_t at = random() % text.size();
            if (random() % 3 == 0)
                text[at] = static_cast<char>(random());
            else if (random() % 2 == 0)
                text.erase(at, random() % 6);
            else
                text.insert(at, good.substr(random() % good.size(), random() % 12));
            if (text.empty()) text = "v";
        }
        const auto obj = parseObjControlMesh(text, "a.obj", SubdivisionScheme::kCatmullClark);
        if (!obj) continue;
        const auto topology = SubdivisionTopology::build(obj->mesh);
        if (!topology) continue;
        ++taken;
        LimitEvaluator evaluator(*topology);
        (void)evaluator.evaluate(obj->mesh.positions, {0, 0.25, 0.5});
    }
    if (seeds.count > 1) {
        EXPECT_GT(taken, seeds.count / 20);
    }
}

TEST(EvaluateCommand, ReadsPlaces) {
    const auto places = parsePlaces("# face u v\n\n3 0.25 1e-3 # here\r\n0 +1 .5", "at.txt");
    ASSERT_TRUE(places.has_value());
    ASSERT_EQ(places->size(), 2U);
    EXPECT_EQ((*places)[0].face, 3U);
    EXPECT_EQ((*places)[0].v, 1e-3);
    EXPECT_EQ((*places)[1].line, 4U);
    EXPECT_EQ(parsePlaces("0 1", "at.txt").error().message, "at.txt:1: a place is 'face u v'");
    EXPECT_EQ(parsePlaces("\n-1 0 0", "at.txt").error().message, "at.txt:2: '-1' is no number of a face");
    EXPECT_EQ(parsePlaces("1 0 0x", "at.txt").error().message, "at.txt:1: '0x' is no number");
}

TEST(EvaluateCommand, ReadsPlacesInSpace) {
    const auto places = parseSpacePlaces("# x y z\n1 -2 +.5\n", "near.txt");
    ASSERT_TRUE(places.has_value());
    ASSERT_EQ(places->size(), 1U);
    EXPECT_EQ((*places)[0].place, Vec3d(1, -2, 0.5));
    EXPECT_EQ((*places)[0].line, 2U);
    EXPECT_EQ(parseSpacePlaces("0 1", "near.txt").error().message, "near.txt:1: a place in space is 'x y z'");
    EXPECT_EQ(parseSpacePlaces("0 1 nan", "near.txt").error().message, "near.txt:1: 'nan' is no number");
}

TEST(EvaluateCommand, SaysWhatItWants) {
    EXPECT_EQ(parseEvaluateArguments({"a.obj"}).error().message,
              "say where with --at FILE or --nearest FILE; see --help");
    EXPECT_EQ(parseEvaluateArguments({"a.obj", "--at", "b", "--nearest", "c"}).error().message,
              "--at or --nearest, not both");
    EXPECT_EQ(parseEvaluateArguments({"a.obj", "--at", "b", "--tolerance", "1"}).error().message,
              "--tolerance is for --nearest");
    for (const char* tolerance : {"0", "-1", "inf"})
        EXPECT_EQ(parseEvaluateArguments({"a.obj", "--nearest", "c", "--tolerance", tolerance}).error().code,
                  ErrorCode::kUsage)
            << tolerance;
    EXPECT_EQ(parseEvaluateArguments({"a.obj", "--at", "b", "--scheme", "butterfly"}).error().code, ErrorCode::kUsage);
    const auto help = parseEvaluateArguments({"--help"});
    ASSERT_TRUE(help.has_value());
    const std::string& text = std::get<EvaluateText>(*help).text;
    for (std::size_t begin = 0; begin < text.size();) {
        const std::size_t end = std::min(text.find('\n', begin), text.size());
        EXPECT_LT(end - begin, 80U) << text.substr(begin, end - begin);
        begin = end + 1;
    }
}

}  // namespace
}  // namespace tessera
