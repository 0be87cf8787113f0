/// Particles of an emitter: where they are, how many, within which bounds; the same bytes on every host; what is
/// refused.
#include "common/drawable/EmitterArrays.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "common/drawable/Drawable.h"
#include "common/drawable/ParticleArrays.h"
#include "tests/property/Seeds.h"

namespace tessera {
namespace {

double numberIn(Random& random, double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
}
Vec3d vectorIn(Random& random, double most) {
    return {numberIn(random, -most, most), numberIn(random, -most, most), numberIn(random, -most, most)};
}

ParticleEmitter someEmitter(Random& random) {
    const double scale = std::pow(10, numberIn(random, -3, 3));
    ParticleEmitter e;
    e.time = numberIn(random, 0, oneIn(random, 3) ? 1e6 : 20);
    e.life = numberIn(random, 0.1, 10);
    e.rate = numberIn(random, 0.1, 300 / e.life);
    e.lifeSpread = oneIn(random, 3) ? 1 : numberIn(random, 0, 1);
    e.seed = static_cast<std::int64_t>(random());
    e.place = static_cast<std::int64_t>(below(random, 4));
    e.extent = scale * (vectorIn(random, 1) + Vec3d::Ones());
    do e.direction = vectorIn(random, 1);
    while (e.direction.norm() < 0.1);
    if (oneIn(random, 4))
        e.direction = Vec3d::Unit(static_cast<Eigen::Index>(below(random, 3))) * (oneIn(random, 2) ? -1 : 1);
    e.directionSpread = oneIn(random, 4) ? std::numbers::pi : numberIn(random, 0, std::numbers::pi);
    e.pace = scale * numberIn(random, 0, 5);
    e.paceSpread = numberIn(random, 0, 1);
    if (oneIn(random, 2)) e.acceleration = vectorIn(random, 10 * scale);
    if (oneIn(random, 2)) e.drag = std::pow(10, numberIn(random, -6, 3));
    e.beginSize = scale * numberIn(random, 0, 0.2);
    e.endSize = scale * numberIn(random, 0, 0.2);
    e.mode = static_cast<std::int64_t>(below(random, 3));
    e.streak = numberIn(random, 0, 1);
    e.sorted = oneIn(random, 2);
    return e;
}

MeshArrays arraysNow(const ParticleEmitter& e) {
    return kEmitterDerivation.derive(&e, {}, nullptr).arrays;
}
std::size_t liveCount(const ParticleEmitter& e) {
    return arraysNow(e).positions.sizeBytes() / 12;
}
Vec3d placeAt(const MeshArrays& arrays, std::size_t i) {
    const std::span<const float> p = arrays.positions.as<float>();
    return Vec3f(p[3 * i], p[3 * i + 1], p[3 * i + 2]).cast<double>();
}

TEST(Emitter, NobodyEverLeavesItsBounds) {
    std::size_t looked = 0;
    forSeeds(400, [&](Random& random) {
        ParticleEmitter e = someEmitter(random);
        const Box box = kEmitterDerivation.bounds(&e);
        ASSERT_FALSE(box.empty());
        for (int turn = 0; turn < 4; ++turn) {
            const MeshArrays arrays = arraysNow(e);
            const std::span<const float> sizes = arrays.texcoords.as<float>();
            for (std::size_t i = 0; i < arrays.positions.sizeBytes() / 12; ++i) {
                const double share = e.mode == ParticleEmitter::kLines   ? 0
                                     : e.mode == ParticleEmitter::kQuads ? std::sqrt(0.5)
                                                                         : 0.5;
                const double reach = share * static_cast<double>(sizes[2 * i]);
                ++looked;
                for (Eigen::Index a = 0; a < 3; ++a) {
                    ASSERT_LE(box.lower[a], placeAt(arrays, i)[a] - reach) << "axis " << a;
                    ASSERT_GE(box.upper[a], placeAt(arrays, i)[a] + reach) << "axis " << a;
                }
            }
            e.time += numberIn(random, 0, 3);  // the bounds are those of any time
            ASSERT_EQ(drawableOf(Object::of(e)).bounds().lower, box.lower);
        }
    });
    EXPECT_GT(looked, 10'000u);
}

/// What flies straight and far fills its bounds: they are no larger than they have to be there.
TEST(Emitter, BoundsOfWhatFliesStraightAreTight) {
    ParticleEmitter e{.time = 10, .rate = 1000, .life = 2};
    e.direction = Vec3d::UnitX();
    e.pace = 3;
    e.beginSize = e.endSize = 0;
    const Box box = kEmitterDerivation.bounds(&e);
    EXPECT_NEAR(box.upper.x(), 6, 1e-4);
    EXPECT_NEAR(box.lower.x(), 0, 1e-4);
    EXPECT_NEAR(box.size().y(), 0, 1e-4);
}

TEST(Emitter, FliesAsTheEquationOfItsForcesSays) {
    forSeeds(40, [](Random& random) {
        ParticleEmitter e{.rate = 0.001, .life = 10};
        e.direction = vectorIn(random, 1) + Vec3d(2, 0, 0);
        e.pace = numberIn(random, 0, 5);
        e.acceleration = vectorIn(random, 10);
        e.drag = oneIn(random, 4) ? 0 : std::pow(10, numberIn(random, -5, 1));
        e.time = numberIn(random, 0.01, 5);
        // x'' = a - d x', by small steps of the classical Runge-Kutta rule.
        constexpr int kSteps = 4000;
        const double h = e.time / kSteps;
        Vec3d x = Vec3d::Zero(), v = e.direction.normalized() * e.pace;
        const auto force = [&](const Vec3d& now) { return Vec3d(e.acceleration - e.drag * now); };
        for (int i = 0; i < kSteps; ++i) {
            const Vec3d v1 = v, a1 = force(v1), v2 = v + h / 2 * a1, a2 = force(v2), v3 = v + h / 2 * a2,
                        a3 = force(v3), v4 = v + h * a3, a4 = force(v4);
            x += h / 6 * (v1 + 2 * v2 + 2 * v3 + v4);
            v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
        }
        const MeshArrays arrays = arraysNow(e);
        ASSERT_EQ(arrays.positions.sizeBytes(), 12u);
        ASSERT_LT((placeAt(arrays, 0) - x).norm(), 1e-5 * (1 + x.norm()))
            << placeAt(arrays, 0).transpose() << " / " << x.transpose();
    });
}

TEST(Emitter, AsManyAreThereAsRateAndLifeSay) {
    ParticleEmitter e{.time = 0, .rate = 100, .life = 2};
    EXPECT_EQ(liveCount(e), 1u) << "the first is born at once";
    e.time = 1.005;
    EXPECT_EQ(liveCount(e), 101u);
    e.time = 1e6 + 0.005;
    EXPECT_EQ(liveCount(e), 200u);
    e.lifeSpread = 1;
    EXPECT_NEAR(static_cast<double>(liveCount(e)), 100, 30);
    e.rate = 0;
    EXPECT_EQ(liveCount(e), 0u);
    EXPECT_TRUE(drawableOf(Object::of(e)).arrays().positions.empty());
}

/// Whoever comes later, or looked elsewhere before, finds each where all others see it.
TEST(Emitter, AParticleIsWhereItIsWhateverElseIsThere) {
    forSeeds(50, [](Random& random) {
        ParticleEmitter e = someEmitter(random);
        e.mode = ParticleEmitter::kPoints;
        e.lifeSpread = 0;
        e.time = 40 + numberIn(random, 0, 1);
        const MeshArrays some = arraysNow(e);
        e.life *= 2;  // twice as many, the newest of whom are the same
        const MeshArrays more = arraysNow(e);
        const std::size_t a = some.positions.sizeBytes() / 12, b = more.positions.sizeBytes() / 12;
        ASSERT_GT(a, 0u);
        ASSERT_GE(b, a);
        for (std::size_t i = 0; i < a; ++i) ASSERT_EQ(placeAt(some, a - 1 - i), placeAt(more, b - 1 - i));
    });
}

TEST(Emitter, LeavesItsPlaceWithinItsSpread) {
    forSeeds(100, [](Random& random) {
        ParticleEmitter e = someEmitter(random);
        e.mode = ParticleEmitter::kPoints;
        e.acceleration = Vec3d::Zero();
        e.drag = 0;
        const double scale = e.extent.maxCoeff();
        ParticleEmitter still = e;
        still.pace = 0;
        const MeshArrays born = arraysNow(still), gone = arraysNow(e);
        ASSERT_EQ(born.positions.sizeBytes(), gone.positions.sizeBytes());
        for (std::size_t i = 0; i < born.positions.sizeBytes() / 12; ++i) {
            const Vec3d p = placeAt(born, i), part = p.cwiseQuotient((e.extent / 2).cwiseMax(1e-30));
            const double out = e.place == ParticleEmitter::kPoint ? 1 + p.norm()
                               : e.place == ParticleEmitter::kBox ? part.cwiseAbs().maxCoeff()
                               : e.place == ParticleEmitter::kSphere
                                   ? part.norm()
                                   : Vec2d(part.x(), part.z()).norm() + std::abs(p.y());
            ASSERT_LE(out, 1 + 1e-5) << "place " << e.place;
            const Vec3d way = placeAt(gone, i) - p;
            const double rounding = 1e-5 * (way.norm() + scale);
            if (way.norm() < 100 * rounding) continue;
            const double off = std::acos(std::clamp(way.normalized().dot(e.direction.normalized()), -1.0, 1.0));
            ASSERT_LE(off, e.directionSpread + 10 * std::sqrt(rounding / way.norm()));
        }
    });
}

TEST(Emitter, AnotherSeedIsAnotherStream) {
    ParticleEmitter e{.time = 3, .directionSpread = 1};
    const BlobId first = arraysNow(e).positions.id();
    EXPECT_EQ(arraysNow(e).positions.id(), first);
    e.seed = 1;
    EXPECT_NE(arraysNow(e).positions.id(), first);
}

/// A compiler may not choose: only operations that IEEE 754 rounds in one way, in an order that is written, and no
/// function of a library. So there is one stored hash for all: g++ 12 and clang 14, -O0 to -O3, on x86-64. Products and
/// sums that are rounded once (-mfma without -ffp-contract=off; g++ on ARM of itself) give other bytes.
TEST(Emitter, IsTheSameToTheBitWhateverMadeTheProgram) {
    ParticleEmitter e{
        .time = 12.25, .rate = 200, .life = 3, .lifeSpread = 0.5, .seed = 7, .place = ParticleEmitter::kSphere};
    e.directionSpread = 0.7;
    e.paceSpread = 0.3;
    e.acceleration = {0.5, -9.8, 0};
    e.drag = 0.4;
    const MeshArrays arrays = arraysNow(e);
    EXPECT_EQ(arrays.positions.sizeBytes() / 12, 447u);
    EXPECT_EQ(toHex(arrays.positions.id()), "2b015cb98d81140b5f7417b265471390");

    std::string all;
    for (e.place = 0; e.place < 4; ++e.place)
        for (e.mode = 0; e.mode < 3; ++e.mode)
            for (const double drag : {0.0, 0.01, 0.4, 7.0}) {
                e.drag = drag;
                e.direction = Vec3d(0.3 + static_cast<double>(e.place), -1 + drag, static_cast<double>(e.mode));
                e.extent = Vec3d(1.7, 0.3, 9);
                const MeshArrays made = arraysNow(e);
                for (const Blob* blob : {&made.positions, &made.normals, &made.texcoords}) all += toHex(blob->id());
                const Box box = kEmitterDerivation.bounds(&e);
                for (const Vec3d& corner : {box.lower, box.upper})
                    all.append(reinterpret_cast<const char*>(corner.data()), 3 * sizeof(double));
            }
    EXPECT_EQ(toHex(hash128(asBytes(all))), "cc0a78baabbca8109907eceb08d2707e");
}

TEST(Emitter, LooksAsItsAgeSays) {
    ParticleEmitter e{.time = 1, .rate = 1, .life = 2};
    e.beginSize = 1;
    e.endSize = 3;
    e.beginColor = Vec4f(1, 0, 0, 1);
    e.endColor = Vec4f(0, 0, 1, 0);
    const MeshArrays arrays = arraysNow(e);
    ASSERT_EQ(arrays.kind, MeshKind::kDiscs);
    ASSERT_EQ(arrays.positions.sizeBytes(), 24u);
    EXPECT_EQ(arrays.texcoords.as<float>()[0], 2) << "the oldest is the first, half way";
    EXPECT_EQ(arrays.texcoords.as<float>()[2], 1) << "one that is just born";
    EXPECT_EQ(arrays.colors.as<std::uint8_t>()[0], 127);
    EXPECT_EQ(arrays.colors.as<std::uint8_t>()[3], 127);
    EXPECT_EQ(arrays.colors.as<std::uint8_t>()[4], 255);
}

TEST(Emitter, TooManyAndNoDirectionAreRefusedInWords) {
    ParticleEmitter e{.rate = 65536, .life = 1};
    EXPECT_TRUE(drawableOf(Object::of(e)).check());
    e.life = 1.5;
    const Expected<void> many = drawableOf(Object::of(e)).check();
    ASSERT_FALSE(many);
    EXPECT_EQ(many.error().message,
              "65536 births per s that live 1.5 s are 98304 particles at a time, at most 65536 are allowed");
    EXPECT_EQ(many.error().code, ErrorCode::kLimit);
    e.life = 1;
    e.direction = Vec3d::Zero();
    ASSERT_FALSE(drawableOf(Object::of(e)).check());
    EXPECT_EQ(drawableOf(Object::of(e)).check().error().message, "its direction is no direction: it is zero");
}

TEST(Emitter, MeetsNobody) {
    const ParticleEmitter e{.time = 3};
    EXPECT_TRUE(drawableOf(Object::of(e)).meetsNobody());
    EXPECT_EQ(drawableOf(Object::of(e)).triangleCount(), 0u);
}

}  // namespace
}  // namespace tessera
