/// Control nets that nobody of this project made: geomdl's examples (../shared/data/nurbs).
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "common/freeform/nurbs/NurbsSurface.h"
#include "tests/unit/nurbs/NurbsOracle.h"

namespace tessera {
namespace {

std::filesystem::path netsFolder() {
    const char* named = std::getenv("TESSERA_TEST_DATA");
    return (named ? std::filesystem::path(named)
                  : std::filesystem::path(TESSERA_SOURCE_DIR) / ".." / "shared" / "data") /
           "nurbs";
}

/// Clamped, evenly spaced: geomdl's own choice for its examples.
KnotVector evenKnots(int degree, int count) {
    KnotVector k{.degree = degree, .knots = std::vector<double>(static_cast<std::size_t>(degree) + 1, 0.0)};
    for (int i = 1; i < count - degree; ++i) k.knots.push_back(i);
    k.knots.insert(k.knots.end(), static_cast<std::size_t>(degree) + 1, count - degree);
    return k;
}

/// A line per row, points apart by semicolons: x, y, z, or w·x, w·y, w·z, w. Rows go along v here.
NurbsDefinition readNet(const std::filesystem::path& file, int degreeU, int degreeV) {
    NurbsDefinition d{.u = {}, .v = {}, .points = {}, .rangeU = {}, .rangeV = {}, .loops = {}};
    std::ifstream in(file);
    std::string line, point, number;
    int rows = 0;
    while (std::getline(in, line)) {
        if (line.empty()) continue;
        ++rows;
        std::istringstream points(line);
        while (std::getline(points, point, ';')) {
            Vec4d p(0, 0, 0, 1);
            std::istringstream numbers(point);
            for (int k = 0; k < 4 && std::getline(numbers, number, ','); ++k) p[k] = std::stod(number);
            d.points.push_back(p);
        }
    }
    d.v = evenKnots(degreeV, rows);
    d.u = evenKnots(degreeU, static_cast<int>(d.points.size()) / std::max(rows, 1));
    return d;
}

void agreesWithTheRecursion(const NurbsSurface& surface) {
    std::mt19937_64 random(1);
    double size = 0;
    for (const Vec4d& p : surface.definition().points) size = std::max(size, p.head<3>().norm());
    for (int k = 0; k < 300; ++k) {
        const double u = someParameter(random, surface.definition().u),
                     v = someParameter(random, surface.definition().v);
        ASSERT_LT((evaluate(surface, u, v).at.point - byCoxDeBoor(surface.definition(), u, v)).norm(), 1e-14 * size)
            << u << " " << v;
    }
}

class RealNets : public testing::Test {
protected:
    void SetUp() override {
        if (!std::filesystem::exists(netsFolder()))
            GTEST_SKIP() << "no test data at " << netsFolder() << " (set TESSERA_TEST_DATA)";
    }
};

TEST_F(RealNets, AreSurfaces) {
    for (const char* file : {"ex_surface01.cpt", "ex_surface02.cpt"}) {
        const NurbsDefinition d = readNet(netsFolder() / "geomdlsurface" / file, 3, 3);
        ASSERT_EQ(d.points.size(), 36u);
        const Expected<NurbsSurface> surface = NurbsSurface::make(d);
        ASSERT_TRUE(surface) << surface.error().message;
        EXPECT_EQ(bezierPatches(*surface).size(), 9u);
        agreesWithTheRecursion(*surface);
    }
}

TEST_F(RealNets, CylindersAreRoundToTheirFourDigits) {
    for (const auto& [file, quarters] : {std::pair("ex_cylinder.cptw", 4), std::pair("ex_cylinder_half.cptw", 2),
                                         std::pair("ex_cylinder_quarter.cptw", 1)}) {
        NurbsDefinition d = readNet(netsFolder() / "geomdlsurface" / file, 2, 1);
        d.u.knots = {0, 0, 0};
        for (int k = 1; k < quarters; ++k) d.u.knots.insert(d.u.knots.end(), 2, k);
        d.u.knots.insert(d.u.knots.end(), 3, quarters);
        const Expected<NurbsSurface> surface = NurbsSurface::make(d);
        ASSERT_TRUE(surface) << file << ": " << surface.error().message;
        agreesWithTheRecursion(*surface);
        for (int i = 0; i <= 40; ++i)
            for (int j = 0; j <= 4; ++j) {
                const SurfacePoint p = evaluate(*surface, quarters * i / 40.0, j / 4.0).at;
                // 0.7071 for 1/√2: half of the last digit over what it is, of the weight, 1e-5.
                EXPECT_NEAR(std::hypot(p.point.x(), p.point.y()), 1, 1e-5) << file;
                EXPECT_NEAR(std::abs(p.normal.dot(Vec3d(p.point.x(), p.point.y(), 0).normalized())), 1, 1e-8) << file;
                EXPECT_NEAR(p.point.z(), j / 4.0, 1e-12) << file;
            }
    }
}

TEST_F(RealNets, TheTorusHasARoundTube) {
    // Around its axis its weights are 1: no circle. Its tube is one, where the rows meet their control points.
    NurbsDefinition d = readNet(netsFolder() / "geomdlsurface" / "ex_torus.cptw", 2, 2);
    ASSERT_EQ(d.points.size(), 81u);
    d.u.knots = d.v.knots = {0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4};
    const Expected<NurbsSurface> surface = NurbsSurface::make(d);
    ASSERT_TRUE(surface) << surface.error().message;
    agreesWithTheRecursion(*surface);
    for (int quarter = 0; quarter <= 4; ++quarter)
        for (int j = 0; j <= 40; ++j) {
            const Vec3d p = evaluate(*surface, quarter, j / 10.0).at.point;
            EXPECT_NEAR(std::hypot(std::hypot(p.x(), p.z()) - 225, p.y()), 100,
                        0.05);  // 0.707 for 1/√2 and its multiples, cut
        }
}

TEST_F(RealNets, TheDuckIsOfThreeSurfaces) {
    // Of geomdl's own loops, v fastest; which it is changes nothing that is judged here. Weights: one file has them.
    struct Part {
        const char* points;
        const char* weights;
        int countU, countV;
    };
    for (const Part& part : {Part{"duck1.ctrlpts", "duck1.weights", 13, 14}, Part{"duck2.ctrlpts", nullptr, 6, 15},
                             Part{"duck3.ctrlpts", nullptr, 6, 6}}) {
        NurbsDefinition d{.u = evenKnots(3, part.countU),
                          .v = evenKnots(3, part.countV),
                          .points = {},
                          .rangeU = {},
                          .rangeV = {},
                          .loops = {}};
        std::ifstream points(netsFolder() / "geomdlobjects" / part.points);
        for (double x, y, z; points >> x >> y >> z;) d.points.emplace_back(x, y, z, 1);
        if (part.weights) {
            std::ifstream in(netsFolder() / "geomdlobjects" / part.weights);
            std::string number;
            for (std::size_t i = 0; i < d.points.size() && std::getline(in, number, ','); ++i)
                d.points[i] *= std::stod(number);
        }
        const Expected<NurbsSurface> surface = NurbsSurface::make(d);
        ASSERT_TRUE(surface) << part.points << ": " << surface.error().message;
        agreesWithTheRecursion(*surface);
    }
}

}  // namespace
}  // namespace tessera
