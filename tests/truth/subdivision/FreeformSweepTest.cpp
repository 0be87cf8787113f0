/// Freeform queries on all shapes and nets of shared/data: each against a moved copy of itself and against a mesh of a
/// ball.
///
/// What judges are points of both bodies that nobody has to look for: random places, evaluated (LimitEvaluator, which
/// OpenSubdivTest has compared; Cox's and de Boor's sums of NURBS). Bodies that are laid so that two such points are
/// one do meet; no point of one is nearer to a point of the other than what a query proves to be the least. So nothing
/// here allows for an error of a tessellation.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <sstream>

#include "common/freeform/subdivision/LimitEvaluator.h"
#include "common/math/Compose.h"
#include "server/collision/freeform/FreeformQuery.h"
#include "server/tools/evaluate/ObjControlMesh.h"

namespace tessera {
namespace {

/// Of a folder of the data, in the order of their names; none where it is missing. Templates and notes beside them are
/// sorted out by whoever reads them.
std::vector<std::filesystem::path> sweptFiles(const std::filesystem::path& folder, const std::string& extension) {
    const char* named = std::getenv("TESSERA_TEST_DATA");
    const std::filesystem::path all =
        (named ? std::filesystem::path(named) : std::filesystem::path(TESSERA_SOURCE_DIR) / ".." / "shared" / "data") /
        folder;
    std::vector<std::filesystem::path> files;
    if (!std::filesystem::is_directory(all)) return files;
    for (const auto& entry : std::filesystem::directory_iterator(all))
        if (extension.empty() || entry.path().extension() == extension) files.push_back(entry.path());
    std::ranges::sort(files);
    return files;
}

class SweepRandom {
public:
    explicit SweepRandom(std::uint64_t seed) : engine_(seed) {}
    double uniform(double low, double high) {
        return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53;
    }
    std::size_t below(std::size_t count) { return static_cast<std::size_t>(engine_() % count); }
    Vec3d direction() {
        for (;;) {
            const Vec3d d(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1));
            if (d.norm() > 0.1 && d.norm() <= 1) return d.normalized();
        }
    }
    Quatd rotation() { return Quatd(Eigen::AngleAxisd(uniform(0, 3.14159), direction())); }

private:
    std::mt19937_64 engine_;
};

/// A body, and points of it.
struct SweptBody {
    std::string name;
    std::optional<FreeformShape> shape;
    std::function<std::optional<Vec3d>(std::uint32_t face, double u, double v)>
        at;  ///< nothing: there is no such place
    std::vector<Vec3d> points;
    double size = 0;
};

SweptBody sweptSubdivision(const std::string& name, const ControlMesh& mesh, FreeformShape shape, SweepRandom& random) {
    SweptBody body{.name = name, .shape = std::move(shape)};
    auto topology = std::make_shared<const SubdivisionTopology>(SubdivisionTopology::build(mesh).value());
    auto evaluator = std::make_shared<LimitEvaluator>(*topology);
    body.at = [mesh, topology, evaluator](std::uint32_t face, double u, double v) -> std::optional<Vec3d> {
        const auto point = evaluator->evaluate(mesh.positions, {face, u, v});
        return point ? std::optional(point->point) : std::nullopt;
    };
    const bool triangle = mesh.scheme == SubdivisionScheme::kLoop;
    for (int tries = 0; tries < 4000 && body.points.size() < 160; ++tries) {
        const auto face = static_cast<std::uint32_t>(random.below(topology->ptexFaceCount()));
        if (!topology->hasSurface(topology->ptexFace(face).face)) continue;
        // Corners and edges too.
        double u = random.below(4) == 0 ? 0 : random.uniform(0, 1), v = random.below(4) == 0 ? 0 : random.uniform(0, 1);
        if (triangle && u + v > 1) {
            u = 1 - u;
            v = 1 - v;
        }
        if (const std::optional<Vec3d> point = body.at(face, u, v)) body.points.push_back(*point);
    }
    body.size = body.shape->bounds().size().norm();
    return body;
}

SweptBody sweptBall(SweepRandom& random, double radius) {
    std::vector<double> positions;
    std::vector<std::uint32_t> indices;
    constexpr std::uint32_t kAround = 24, kUp = 12;
    for (std::uint32_t j = 0; j <= kUp; ++j)
        for (std::uint32_t i = 0; i < kAround; ++i) {
            const double a = 2 * 3.14159265358979 * i / kAround, b = 3.14159265358979 * (j / double(kUp) - 0.5);
            for (const double x : {std::cos(a) * std::cos(b), std::sin(b), std::sin(a) * std::cos(b)})
                positions.push_back(radius * x);
        }
    for (std::uint32_t j = 0; j < kUp; ++j)
        for (std::uint32_t i = 0; i < kAround; ++i) {
            const std::uint32_t a = j * kAround + i, b = j * kAround + (i + 1) % kAround;
            indices.insert(indices.end(), {a, b, b + kAround, a, b + kAround, a + kAround});
        }
    SweptBody body{
        .name = "ball",
        .shape = FreeformShape::ofTriangles(TriangleMesh::make(std::span<const double>(positions), indices).value())
                     .value()};
    const auto corner = [=](std::size_t index) {
        const std::size_t at = 3 * indices[index];
        return Vec3d(positions[at], positions[at + 1], positions[at + 2]);
    };
    body.at = [=](std::uint32_t face, double u, double v) -> std::optional<Vec3d> {
        const Vec3d a = corner(3 * face), b = corner(3 * face + 1), c = corner(3 * face + 2);
        return Vec3d(a + u * (b - a) + v * (c - a));
    };
    for (int i = 0; i < 160; ++i) {
        double u = random.uniform(0, 1), v = random.uniform(0, 1);
        if (u + v > 1) {
            u = 1 - u;
            v = 1 - v;
        }
        body.points.push_back(*body.at(static_cast<std::uint32_t>(random.below(indices.size() / 3)), u, v));
    }
    body.size = body.shape->bounds().size().norm();
    return body;
}

/// Where hundreds of faces share a vertex, near it is work that a server would not do either; then it is not known,
/// never denied.
constexpr std::uint64_t kMostWork = 60'000;
struct SweepCounts {
    std::size_t asked = 0, exhausted = 0;
};

void sweep(SweptBody& a, SweptBody& b, SweepRandom& random, int poses, SweepCounts& counts) {
    ASSERT_FALSE(a.points.empty());
    ASSERT_FALSE(b.points.empty());
    FreeformPair pair(*a.shape, *b.shape);
    const double size = a.size + b.size;
    double largest = 0;  // coordinates, by which numbers round
    for (const SweptBody* body : {&a, &b})
        for (const Vec3d& point : body->points) largest = std::max(largest, point.norm());
    const double rounding = 1e-12 * (size + largest);
    for (int i = 0; i < poses; ++i) {
        SCOPED_TRACE("pose " + std::to_string(i));
        const Quatd turn = random.rotation();
        const Vec3d onA = a.points[random.below(a.points.size())], onB = b.points[random.below(b.points.size())];
        const Vec3d meets = onA - turn * onB, away = random.direction();

        // Two points are one.
        const double tolerance = 1e-6 * size;
        const auto fresh = [] { return QueryWork{.limit = kMostWork}; };
        const auto answered = [&](bool complete) {
            ++counts.asked;
            counts.exhausted += complete ? 0 : 1;
            return complete;
        };
        QueryWork work = fresh();
        Affine3d pose = composeTransform(meets, turn, Vec3d::Ones());
        const Touch together = pair.touch(pose, tolerance, work).touch;
        ASSERT_NE(together, Touch::kNo);
        (void)answered(together == Touch::kYes);
        work = fresh();
        const FreeformDistance zero = pair.distance(pose, work, {.tolerance = tolerance});
        ASSERT_LE(zero.least, rounding);
        if (answered(zero.complete)) {
            ASSERT_LE(zero.distance, tolerance + rounding);
        }

        // Somewhere beside it: near and far.
        pose = composeTransform(meets + std::pow(10, random.uniform(-4, 0.3)) * size * away, turn, Vec3d::Ones());
        double near = size * 1e9;
        for (const Vec3d& p : b.points) {
            const Vec3d there = pose * p;
            for (const Vec3d& q : a.points) near = std::min(near, (q - there).norm());
        }
        work = fresh();
        const FreeformDistance found = pair.distance(pose, work, {.tolerance = tolerance});
        ASSERT_LE(found.least, near + rounding) << "two points are nearer than what is proven";
        ASSERT_LE(found.least, found.distance);
        if (answered(found.complete)) {
            ASSERT_LE(found.distance - found.least, tolerance * (1 + 1e-9));
        }
        const std::optional<Vec3d> placeA = a.at(found.a.face, found.a.u, found.a.v),
                                   placeB = b.at(found.b.face, found.b.u, found.b.v);
        ASSERT_TRUE(placeA && placeB) << found.complete << ' ' << found.distance << ' ' << found.least << ": "
                                      << found.a.face << ' ' << found.a.u << ' ' << found.a.v << ", " << found.b.face
                                      << ' ' << found.b.u << ' ' << found.b.v;
        ASSERT_LT((*placeA - found.a.point).norm(), rounding) << "the place is the surface's";
        ASSERT_LT((pose * *placeB - found.b.point).norm(), rounding);
        ASSERT_NEAR((found.a.point - found.b.point).norm(), found.distance, rounding);
        work = fresh();
        const Touch touch = pair.touch(pose, tolerance, work).touch;
        (void)answered(touch != Touch::kUnknown);
        if (found.least > tolerance + rounding) {
            ASSERT_NE(touch, Touch::kYes);
        }

        // On a straight way on which the two points are one at a third of the time.
        const double reach = size * random.uniform(0.1, 2);
        const BodyMotion still{};
        const BodyMotion moves{.start = {.translation = meets + reach * away, .rotation = turn},
                               .end = {.translation = meets - 2 * reach * away, .rotation = turn}};
        work = fresh();
        const FreeformImpact impact = pair.firstContact(still, moves, tolerance, work);
        ASSERT_LE(impact.t, 1.0 / 3 + 1e-9) << "late";
        if (answered(impact.complete)) {
            ASSERT_TRUE(impact.hit);
            const Affine3d then = composeTransform(meets + (1 - 3 * impact.t) * reach * away, turn, Vec3d::Ones());
            work = fresh();
            const FreeformDistance left = pair.distance(then, work, {.tolerance = 0.01 * tolerance});
            ASSERT_LE(left.least, tolerance * 1.001 + rounding)
                << "the places of a hit are no farther apart than the tolerance";
        }
    }
}

std::uint64_t sweepSeed() {
    const char* given = std::getenv("TESSERA_SEED");
    return given ? std::strtoull(given, nullptr, 10) : std::random_device()();
}

TEST(FreeformSweep, MissesNoContactOfAnyShape) {
    const std::vector<std::filesystem::path> files = sweptFiles("subdiv", ".obj");
    if (files.empty()) GTEST_SKIP() << "no shapes (TESSERA_TEST_DATA)";
    const std::uint64_t seed = sweepSeed();
    SCOPED_TRACE("TESSERA_SEED=" + std::to_string(seed) +
                 " build/bin/truth_subdivision --gtest_filter=FreeformSweep.*");
    std::size_t swept = 0, refused = 0;
    SweepCounts counts;
    for (const std::filesystem::path& file : files) {
        const std::string name = file.stem();
        SCOPED_TRACE(name);
        const SubdivisionScheme scheme = name.starts_with("loop")       ? SubdivisionScheme::kLoop
                                         : name.starts_with("bilinear") ? SubdivisionScheme::kBilinear
                                                                        : SubdivisionScheme::kCatmullClark;
        std::ifstream in(file);
        std::stringstream text;
        text << in.rdbuf();
        const auto obj = parseObjControlMesh(text.str(), name, scheme);
        ASSERT_TRUE(obj) << obj.error().message;
        SweepRandom random(seed ^ std::hash<std::string>()(name));
        Expected<FreeformShape> shape = FreeformShape::ofSubdivision(obj->mesh);
        if (!shape) {
            EXPECT_EQ(scheme, SubdivisionScheme::kBilinear) << shape.error().message;
            ++refused;
            continue;
        }
        const auto begin = std::chrono::steady_clock::now();
        SweptBody a = sweptSubdivision(name, obj->mesh, std::move(*shape), random),
                  b = sweptSubdivision(name, obj->mesh, FreeformShape::ofSubdivision(obj->mesh).value(), random),
                  ball = sweptBall(random, 0.3 * a.size);
        ASSERT_NO_FATAL_FAILURE(sweep(a, b, random, 2, counts));
        ASSERT_NO_FATAL_FAILURE(sweep(a, ball, random, 1, counts));
        ++swept;
        if (std::getenv("TESSERA_SWEEP_TIMES")) {
            std::printf("%s %.0f ms\n", name.c_str(),
                        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count());
            std::fflush(stdout);
        }
    }
    EXPECT_GT(swept, 60u);
    EXPECT_LE(refused, 3u);
    EXPECT_LT(counts.exhausted, counts.asked / 20) << "what is not answered is no answer";
    RecordProperty("asked", static_cast<int>(counts.asked));
    RecordProperty("exhausted", static_cast<int>(counts.exhausted));
}

/// Clamped, evenly spaced.
KnotVector sweptKnots(int degree, int count) {
    KnotVector knots{.degree = degree, .knots = std::vector<double>(static_cast<std::size_t>(degree) + 1, 0.0)};
    for (int i = 1; i < count - degree; ++i) knots.knots.push_back(i);
    knots.knots.insert(knots.knots.end(), static_cast<std::size_t>(degree) + 1, count - degree);
    return knots;
}

/// A line per row, points apart by semicolons: x, y, z, or w·x, w·y, w·z, w. Nothing of a file that holds other things
/// (a template).
std::optional<NurbsSurface> sweptNet(const std::filesystem::path& file) {
    std::ifstream in(file);
    std::string line, point, number;
    NurbsDefinition net{.u = {}, .v = {}, .points = {}, .rangeU = {}, .rangeV = {}, .loops = {}};
    int rows = 0;
    while (std::getline(in, line)) {
        if (line.empty()) continue;
        ++rows;
        std::istringstream points(line);
        while (std::getline(points, point, ';')) {
            Vec4d p(0, 0, 0, 1);
            std::istringstream numbers(point);
            for (int k = 0; k < 4 && std::getline(numbers, number, ','); ++k) {
                char* end = nullptr;
                p[k] = std::strtod(number.c_str(), &end);
                if (end == number.c_str()) return {};
            }
            net.points.push_back(p);
        }
    }
    const int columns = static_cast<int>(net.points.size()) / std::max(rows, 1);
    if (rows < 2 || columns < 2) return {};
    net.u = sweptKnots(std::min(3, columns - 1), columns);
    net.v = sweptKnots(std::min(3, rows - 1), rows);
    Expected<NurbsSurface> surface = NurbsSurface::make(std::move(net));
    EXPECT_TRUE(surface) << file << ": " << surface.error().message;
    return surface ? std::optional(std::move(*surface)) : std::nullopt;
}

SweptBody sweptNurbs(const std::string& name, const NurbsSurface& surface, SweepRandom& random) {
    SweptBody body{.name = name, .shape = FreeformShape::ofNurbs({surface}).value()};
    body.at = [surface](std::uint32_t, double u, double v) -> std::optional<Vec3d> {
        return evaluate(surface, u, v).at.point;
    };
    const ParameterRectangle& domain = surface.domain();
    for (int i = 0; i < 160; ++i) {
        const auto within = [&](const ParameterRange& range) {
            return random.below(4) == 0 ? range.lower : random.uniform(range.lower, range.upper);
        };
        body.points.push_back(*body.at(0, within(domain.u), within(domain.v)));
    }
    body.size = body.shape->bounds().size().norm();
    return body;
}

TEST(FreeformSweep, MissesNoContactOfAnyNet) {
    const std::vector<std::filesystem::path> files = sweptFiles(std::filesystem::path("nurbs") / "geomdlsurface", "");
    if (files.empty()) GTEST_SKIP() << "no nets (TESSERA_TEST_DATA)";
    const std::uint64_t seed = sweepSeed();
    SCOPED_TRACE("TESSERA_SEED=" + std::to_string(seed) +
                 " build/bin/truth_subdivision --gtest_filter=FreeformSweep.*");
    std::size_t swept = 0;
    SweepCounts counts;
    for (const std::filesystem::path& file : files) {
        const std::string name = file.stem();
        SCOPED_TRACE(name);
        const std::optional<NurbsSurface> surface = sweptNet(file);
        if (!surface) continue;
        SweepRandom random(seed ^ std::hash<std::string>()(name));
        SweptBody a = sweptNurbs(name, *surface, random), b = sweptNurbs(name, *surface, random),
                  ball = sweptBall(random, 0.3 * a.size);
        ASSERT_NO_FATAL_FAILURE(sweep(a, b, random, 6, counts));
        ASSERT_NO_FATAL_FAILURE(sweep(a, ball, random, 6, counts));
        ++swept;
    }
    EXPECT_GE(swept, 5u);
    EXPECT_LT(counts.exhausted, counts.asked / 20) << "what is not answered is no answer";
}

}  // namespace
}  // namespace tessera
