// A mesh that a lattice bends, as whoever draws and collides sees it.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>

#include "common/drawable/DeformationArrays.h"
#include "common/drawable/Drawable.h"
#include "common/freeform/lattice/Lattice.h"
#include "tests/support/words/Words.h"

namespace tessera {
namespace {

Blob floatsOf(const std::vector<float>& values) {
    return Blob::of(std::span<const float>(values));
}

/// Around the pole, the poles aside: (-y, x, 0); their side changes from vertex to vertex.
Blob someTangents(std::span<const float> normals) {
    std::vector<float> tangents;
    for (std::size_t i = 0; i < normals.size(); i += 3) {
        Vec3f t(-normals[i + 1], normals[i], 0);
        t = t.norm() > 1e-3F ? Vec3f(t.normalized()) : Vec3f(Vec3f::UnitX());
        tangents.insert(tangents.end(), {t.x(), t.y(), t.z(), i % 2 == 0 ? 1.0F : -1.0F});
    }
    return floatsOf(tangents);
}

/// A sphere and its box, whose control points are at rest, or where `map` puts them.
template <typename Map>
Deformation bentSphere(std::int64_t points, std::int64_t degree, Map&& map) {
    const MeshArrays mesh = makeSphere(1, 24).toArrays();
    Deformation d;
    d.positions = mesh.positions;
    d.normals = mesh.normals;
    d.indices = mesh.indices;
    d.tangents = someTangents(mesh.normals.as<float>());
    d.pointsX = d.pointsY = d.pointsZ = points;
    d.degreeX = d.degreeY = d.degreeZ = degree;
    const auto n = static_cast<unsigned>(points), k = static_cast<unsigned>(degree);
    const Lattice lattice =
        Lattice::make(LatticeVolume::of({d.lower, d.upper}), {LatticeAxis{k, n}, {k, n}, {k, n}}).value();
    std::vector<float> controls;
    for (std::size_t i = 0; i < lattice.controlPoints().size(); ++i) {
        const Vec3d at = map(lattice.atRest(i));
        for (const double x : at) controls.push_back(static_cast<float>(x));
    }
    d.controlPoints = floatsOf(controls);
    return d;
}
Drawable drawableOfValue(const Deformation& d) {
    return drawableOf(Object::of(d));
}

TEST(DeformationArrays, StandWhereTheLatticeSays) {
    const auto still = [](const Vec3d& x) { return x; };
    Deformation rest = bentSphere(4, 3, still);
    const auto from = rest.positions.as<float>();
    for (const bool said : {true, false}) {
        if (!said) rest.controlPoints = {};
        const MeshArrays arrays = drawableOfValue(rest).arrays();
        const auto to = arrays.positions.as<float>();
        ASSERT_EQ(to.size(), from.size());
        for (std::size_t i = 0; i < from.size(); ++i) ASSERT_NEAR(to[i], from[i], said ? 1e-6 : 0);
        EXPECT_EQ(arrays.indices.id(), rest.indices.id());
    }
    // Control points under an affine map move the mesh by that map.
    Mat3d m;
    m << 1, 0.5, 0, 0, 2, 0.1, -0.3, 0, 1;
    const Vec3d t(3, -1, 0.5);
    for (const auto& [points, degree] : {std::pair(2, 1), {4, 3}, {7, 3}, {5, 2}}) {
        m.row(1) = -m.row(1);  // a mirror, every other time
        const Deformation d = bentSphere(points, degree, [&](const Vec3d& x) { return Vec3d(m * x + t); });
        ASSERT_TRUE(drawableOfValue(d).check());
        const MeshArrays arrays = drawableOfValue(d).arrays();
        EXPECT_TRUE(checkMesh(arrays));
        const auto to = arrays.positions.as<float>(), normals = arrays.normals.as<float>(),
                   tangents = arrays.tangents.as<float>(), tangentsFrom = d.tangents.as<float>();
        ASSERT_EQ(tangents.size(), tangentsFrom.size());
        for (std::size_t i = 0; i + 3 < tangents.size(); i += 4) {
            const Vec3d along(tangentsFrom[i], tangentsFrom[i + 1], tangentsFrom[i + 2]);
            ASSERT_LT((Vec3d(tangents[i], tangents[i + 1], tangents[i + 2]) - (m * along).normalized()).norm(), 1e-4);
            ASSERT_EQ(tangents[i + 3], m.determinant() < 0 ? -tangentsFrom[i + 3] : tangentsFrom[i + 3]);
        }
        for (std::size_t i = 0; i + 2 < from.size(); i += 3) {
            const Vec3d x(from[i], from[i + 1], from[i + 2]), wanted = m * x + t;
            ASSERT_LT((Vec3d(to[i], to[i + 1], to[i + 2]) - wanted).norm(), 2e-6);
            ASSERT_LT(
                (Vec3d(normals[i], normals[i + 1], normals[i + 2]) - (m.inverse().transpose() * x).normalized()).norm(),
                1e-4);
        }
    }
    // What is outside of the volume stays.
    Deformation half = bentSphere(4, 3, [](const Vec3d& x) { return Vec3d(x + Vec3d(0, 1, 0)); });
    half.upper = Vec3d(1, 0, 1);
    const MeshArrays shifted = drawableOfValue(half).arrays();
    const auto to = shifted.positions.as<float>();
    for (std::size_t i = 0; i + 2 < from.size(); i += 3)
        if (from[i + 1] > 1e-6F) {
            ASSERT_EQ(to[i + 1], from[i + 1]);
        }
}

TEST(DeformationArrays, RefuseWhatIsNoLatticeByName) {
    const auto why = [](auto&& spoil) {
        Deformation d = bentSphere(4, 3, [](const Vec3d& x) { return x; });
        spoil(d);
        const Expected<void> checked = drawableOfValue(d).check();
        EXPECT_EQ(drawableOfValue(d).arrays().positions.empty(), !checked) << "what is refused has no triangles";
        return checked ? std::string() : checked.error().message;
    };
    EXPECT_EQ(why([](Deformation&) {}), "");
    EXPECT_WORDS(why([](Deformation& d) { d.pointsX = 3; }));
    EXPECT_WORDS(why([](Deformation& d) { d.pointsY = 5; }));
    EXPECT_WORDS(why([](Deformation& d) { d.upper.z() = -1; }));
    EXPECT_WORDS(why([](Deformation& d) { d.upper.z() = -1 + 1e-300; }));
    EXPECT_WORDS(why([](Deformation& d) {
        d.indices = Blob::of(std::span<const std::uint32_t>(std::vector<std::uint32_t>{0, 1, 99'999}));
    }));
    EXPECT_WORDS(why([](Deformation& d) { d.positions = {}; }));
    for (const float bad : {NAN, INFINITY, -2e30F})
        EXPECT_WORDS(why([&](Deformation& d) {
            d.controlPoints = *d.controlPoints.withRange(12, std::as_bytes(std::span(&bad, 1)));
        }));
    EXPECT_TRUE(drawableOfValue(Deformation()).check()) << "nothing at all is fine";
    EXPECT_EQ(drawableOfValue(Deformation()).triangleCount(), 0u);
}

TEST(DeformationArrays, FollowRangesOfControlPointsToTheSameBytes) {
    const char* one = std::getenv("TESSERA_SEED");
    const std::uint64_t first = one ? std::strtoull(one, nullptr, 10) : 1, last = one ? first : 40;
    std::size_t parts = 0, same = 0;
    for (std::uint64_t seed = first; seed <= last; ++seed) {
        SCOPED_TRACE(::testing::Message()
                     << "TESSERA_SEED=" << seed << " build/bin/unit_drawable --gtest_filter=DeformationArrays.*");
        std::mt19937_64 random(seed);
        const auto number = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
        const auto points = static_cast<std::int64_t>(2 + random() % 9),
                   degree = static_cast<std::int64_t>(
                       1 + random() % static_cast<std::uint64_t>(std::min<std::int64_t>(points - 1, 4)));
        Deformation d = bentSphere(points, degree, [&](const Vec3d& x) {
            return Vec3d(x + 0.3 * Vec3d(number(-1, 1), number(-1, 1), number(-1, 1)));
        });
        if (random() % 3 == 0) d.upper = Vec3d(number(0, 2), number(0, 2), number(0, 2));
        if (random() % 3 == 0) d.normals = {};
        MeshArrays known = drawableOfValue(d).arrays();
        for (int step = 0; step < 5; ++step) {
            const std::size_t count = d.controlPoints.sizeBytes() / 4, at = random() % count;
            std::vector<float> moved(1 + random() % std::min<std::size_t>(7, count - at));
            for (float& x : moved) x = static_cast<float>(number(-2, 2));
            d.controlPoints = *d.controlPoints.withRange(4 * at, std::as_bytes(std::span<const float>(moved)));
            const MeshArrays arrays = drawableOfValue(d).arrays();
            const DerivedMesh fresh = kDeformationDerivation.derive(&d, 0, nullptr);
            ASSERT_EQ(arrays.positions.id(), fresh.arrays.positions.id()) << step;
            ASSERT_EQ(arrays.normals.id(), fresh.arrays.normals.id()) << step;
            ASSERT_EQ(arrays.tangents.id(), fresh.arrays.tangents.id()) << step;
            ASSERT_EQ(blobIdOf(arrays.positions.bytes()), arrays.positions.id());
            bool found = keyOf(arrays) == keyOf(known);
            same += found;
            for (const MeshOrigin& origin : originsOf(arrays)) {
                if (origin.key != keyOf(known)) continue;
                found = true;
                parts += origin.changed[0].end - origin.changed[0].begin < arrays.positions.sizeBytes();
                const ByteSpan now = arrays.positions.bytes(), then = known.positions.bytes();
                for (std::size_t i = 0; i < now.size(); ++i) {
                    if (i < origin.changed[0].begin || i >= origin.changed[0].end) {
                        ASSERT_EQ(now[i], then[i]);
                    }
                }
            }
            EXPECT_TRUE(found);
            known = arrays;
        }
    }
    if (!one) {
        EXPECT_GT(parts, 20u) << "ranges are said, not the whole";
        EXPECT_LT(same, 40u);
    }
}

}  // namespace
}  // namespace tessera
