/// Particles as arrays: what each looks like at its age; the same bytes along whatever edits; what is refused.
#include "common/drawable/ParticleArrays.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "common/drawable/Drawable.h"
#include "tests/property/Seeds.h"
#include "tests/support/words/Words.h"

namespace tessera {
namespace {

template <typename Number>
Blob particleBlob(const std::vector<Number>& numbers) {
    return numbers.empty() ? Blob() : Blob::of(std::span<const Number>(numbers));
}
float particleNumber(Random& random, double low, double high) {
    return static_cast<float>(low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53);
}

Particles someParticles(Random& random, std::int64_t mode) {
    const std::size_t count = 1 + below(random, 60);
    const auto numbers = [&](std::size_t each, double low, double high) {
        std::vector<float> all;
        for (std::size_t i = 0; i < count * each; ++i) all.push_back(particleNumber(random, low, high));
        return particleBlob(all);
    };
    Particles p;
    p.mode = mode;
    p.positions = numbers(3, -5, 5);
    p.tails = numbers(3, -5, 5);
    if (oneIn(random, 2)) p.sizes = numbers(1, 0, 3);
    if (oneIn(random, 2)) p.ages = numbers(1, -0.2, 1.2);
    if (oneIn(random, 2)) p.turns = numbers(1, -9, 9);
    if (oneIn(random, 2)) p.ageSizes = particleBlob<float>({0, 2, 1});
    if (oneIn(random, 2)) p.ageColors = particleBlob<std::uint8_t>({255, 255, 255, 255, 0, 0, 0, 0});
    p.sorted = oneIn(random, 2);
    return p;
}

bool sameParticleArrays(const MeshArrays& a, const MeshArrays& b) {
    return keyOf(a) == keyOf(b) && a.lineWidth == b.lineWidth;
}

TEST(Particles, AreTheSameBytesAlongWhateverEdits) {
    forSeeds(100, [](Random& random) {
        Particles p = someParticles(random, static_cast<std::int64_t>(below(random, 3)));
        (void)drawableOf(Object::of(p)).arrays();
        const std::size_t count = p.positions.sizeBytes() / 12;
        for (int turn = 0; turn < 6; ++turn) {
            const std::size_t first = below(random, count), end = first + 1 + below(random, count - first);
            std::vector<float> moved;
            for (std::size_t i = 3 * first; i < 3 * end; ++i) moved.push_back(particleNumber(random, -5, 5));
            p.positions = *p.positions.withRange(12 * first, std::as_bytes(std::span<const float>(moved)));
            const MeshArrays followed = drawableOf(Object::of(p)).arrays();
            ASSERT_TRUE(checkMesh(followed));
            EXPECT_FALSE(originsOf(followed).empty());
            Particles anew = p;
            const std::vector<float> whole(p.positions.as<float>().begin(), p.positions.as<float>().end());
            anew.positions = particleBlob(whole);
            ASSERT_TRUE(sameParticleArrays(followed, kParticleDerivation.derive(&anew, {}, nullptr).arrays));
        }
    });
}

TEST(Particles, ReachAsFarAsTheirBoxSays) {
    forSeeds(100, [](Random& random) {
        const Particles p = someParticles(random, oneIn(random, 2) ? Particles::kPoints : Particles::kQuads);
        const Drawable drawable = drawableOf(Object::of(p));
        const MeshArrays arrays = drawable.arrays();
        const Box box = drawable.bounds();
        const std::span<const float> places = arrays.positions.as<float>(), sizes = arrays.texcoords.as<float>();
        for (std::size_t i = 0; i < places.size() / 3; ++i) {
            const double reach =
                0.5 * static_cast<double>(sizes[2 * i]) * (p.mode == Particles::kQuads ? std::sqrt(2.0) : 1.0);
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const auto a = static_cast<Eigen::Index>(axis);
                ASSERT_LE(box.lower[a], static_cast<double>(places[3 * i + axis]) - reach);
                ASSERT_GE(box.upper[a], static_cast<double>(places[3 * i + axis]) + reach);
            }
        }
    });
}

TEST(Particles, FollowTheirRamps) {
    Particles p;
    p.positions = particleBlob<float>({0, 0, 0, 1, 0, 0, 2, 0, 0, 3, 0, 0, 4, 0, 0});
    p.ages = particleBlob<float>({0, 0.25F, 1, 1.5F, -std::numeric_limits<float>::infinity()});
    p.sizes = particleBlob<float>({1, 2, 3, 4, 5});
    p.ageSizes = particleBlob<float>({2, 4, 10});
    p.colors =
        particleBlob<std::uint8_t>({255, 255, 255, 255, 255, 255, 255, 255, 51, 102, 255, 255, 9, 9, 9, 9, 9, 9, 9, 9});
    p.ageColors = particleBlob<std::uint8_t>({0, 100, 200, 255, 255, 100, 0, 255, 255, 255, 0, 128});
    const MeshArrays arrays = drawableOf(Object::of(p)).arrays();
    const std::span<const float> sizes = arrays.texcoords.as<float>();
    EXPECT_EQ(sizes[0], 2);
    EXPECT_EQ(sizes[2], 6) << "2 times 3, halfway from 2 to 4";
    EXPECT_EQ(sizes[4], 30);
    EXPECT_EQ(sizes[6], 0) << "past its end";
    EXPECT_EQ(sizes[8], 0) << "not born";
    const std::span<const std::uint8_t> colors = arrays.colors.as<std::uint8_t>();
    const auto expectColor = [&](std::size_t i, std::array<int, 4> wanted) {
        for (std::size_t c = 0; c < 4; ++c) EXPECT_NEAR(colors[4 * i + c], wanted[c], 1) << i << ' ' << c;
    };
    expectColor(0, {0, 100, 200, 255});
    expectColor(1, {128, 100, 100, 255});
    expectColor(2, {51, 102, 0, 128});
}

TEST(Particles, AreNothingToWhoeverCollidesOrPicks) {
    Particles p;
    p.positions = particleBlob<float>({0, 0, 0, 1, 0, 0, 2, 0, 0});
    p.tails = p.positions;
    for (p.mode = 0; p.mode < 3; ++p.mode) {
        const MeshArrays arrays = drawableOf(Object::of(p)).arrays();
        EXPECT_TRUE(arrays.indices.empty());
        EXPECT_EQ(triangleCount(arrays), 0u);
    }
}

TEST(Particles, AreRefusedInWords) {
    const float none = std::numeric_limits<float>::quiet_NaN(), infinite = std::numeric_limits<float>::infinity();
    const auto expectRefused = [](const std::function<void(Particles&)>& spoil) {
        Particles p;
        p.positions = particleBlob<float>({0, 0, 0, 1, 1, 1});
        ASSERT_TRUE(drawableOf(Object::of(p)).check());
        spoil(p);
        const Expected<void> sound = drawableOf(Object::of(p)).check();
        ASSERT_FALSE(sound);
        EXPECT_WORDS(sound.error().message);
        EXPECT_TRUE(drawableOf(Object::of(p)).arrays().positions.empty()) << sound.error().message;
    };
    expectRefused([](Particles& p) { p.positions = Blob(Bytes(10)); });
    expectRefused([&](Particles& p) { p.positions = particleBlob<float>({0, 0, 0, none, 1, 1}); });
    expectRefused([](Particles& p) { p.mode = Particles::kLines; });
    expectRefused([](Particles& p) { p.mode = Particles::kLines, p.tails = particleBlob<float>({0, 0, 0}); });
    expectRefused([&](Particles& p) {
        p.mode = Particles::kLines, p.tails = particleBlob<float>({infinite, 0, 0, 0, 0, 0});
    });
    expectRefused([](Particles& p) { p.colors = particleBlob<std::uint8_t>({1, 2, 3, 4}); });
    expectRefused([](Particles& p) { p.sizes = particleBlob<float>({1}); });
    expectRefused([](Particles& p) { p.sizes = particleBlob<float>({1, -1}); });
    expectRefused([&](Particles& p) { p.sizes = particleBlob<float>({none, 1}); });
    expectRefused([&](Particles& p) { p.ages = particleBlob<float>({0, none}); });
    expectRefused([&](Particles& p) { p.mode = Particles::kQuads, p.turns = particleBlob<float>({infinite, 0}); });
    expectRefused([](Particles& p) { p.ageColors = Blob(Bytes(3)); });
    expectRefused([](Particles& p) { p.ageSizes = particleBlob<float>({1, -2}); });
    expectRefused([](Particles& p) { p.positions = Blob(Bytes(12 * (kMostParticles + 1))); });
}

}  // namespace
}  // namespace tessera
