// Plates beside a look at each pixel.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "client/render/cull/DepthPyramid.h"
#include "client/render/cull/PlateCuts.h"

namespace tessera {
namespace {

using Plate = VisibilityDevice::Plate;

/// Depths of a part: smooth here and there, so that plates are hidden, with single pixels that show.
struct Depths {
    int width, height;
    std::vector<float> at;

    Depths(std::mt19937& random, int w, int h) : width(w), height(h), at(static_cast<std::size_t>(w * h)) {
        const float ground = static_cast<float>(random() % 80) / 100;
        for (float& depth : at) depth = random() % 40 == 0 ? 0.05f : ground + static_cast<float>(random() % 20) / 100;
        if (random() % 2) std::fill(at.begin(), at.end(), ground);
        if (random() % 2) at[random() % at.size()] = 0.1f;
    }
    [[nodiscard]] bool hides(const Plate& plate) const {
        for (int y = plate.bottom; y < plate.top; ++y)
            for (int x = plate.left; x < plate.right; ++x)
                if (at[static_cast<std::size_t>(y * width + x)] <= plate.depth) return false;
        return true;
    }
};

Plate somePlate(std::mt19937& random, int width, int height) {
    const auto below = [&](int size) { return static_cast<int>(random() % static_cast<unsigned>(size)); };
    Plate plate;
    plate.left = below(width);
    plate.bottom = below(height);
    const int reach = random() % 3 ? 12 : 100;
    plate.right = std::min(width, plate.left + 1 + below(reach));
    plate.top = std::min(height, plate.bottom + 1 + below(reach));
    plate.depth = static_cast<float>(random() % 100) / 100;
    return plate;
}

TEST(DepthPyramid, HidesWhatEachPixelHides) {
    int hidden = 0;
    for (unsigned seed = 0; seed < 400; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        std::mt19937 random(seed);
        const Depths depths(random, 1 + static_cast<int>(random() % 90), 1 + static_cast<int>(random() % 70));
        DepthPyramid pyramid;
        pyramid.build(depths.at, depths.width, depths.height);
        for (int i = 0; i < 60; ++i) {
            const Plate plate = somePlate(random, depths.width, depths.height);
            ASSERT_EQ(pyramid.hides(plate), depths.hides(plate))
                << plate.left << " " << plate.bottom << " " << plate.right << " " << plate.top << " at " << plate.depth;
            hidden += depths.hides(plate);
        }
    }
    EXPECT_GT(hidden, 1000);
}

TEST(PlateCuts, AnAnswerThatRestsOnHiddenOnesIsTrue) {
    int proven = 0, apart = 0;
    for (unsigned seed = 0; seed < 3000; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        std::mt19937 random(seed);
        const Depths depths(random, 60, 40);
        const std::size_t questions = 1 + random() % 8;
        std::vector<PlateCuts::Asked> plates;
        const unsigned count = random() % 25;
        const bool allCut = random() % 2 != 0;
        std::vector<int> asked(60 * 40);
        for (unsigned i = 0; i < count; ++i)
            plates.push_back({.plate = somePlate(random, 60, 40),
                              .question = static_cast<std::uint32_t>(random() % questions),
                              .cuts = allCut || random() % 4 != 0});
        PlateCuts cuts;
        cuts.cut(plates, questions);
        ASSERT_EQ(cuts.sizes().size(), questions);
        std::vector<bool> shows(questions, false);
        std::size_t next = 0;
        for (std::size_t q = 0; q < questions; ++q)
            for (std::uint32_t i = 0; i < cuts.sizes()[q]; ++i, ++next) {
                const Plate& piece = cuts.plates()[next];
                ASSERT_TRUE(piece.left < piece.right && piece.bottom < piece.top);
                shows[q] = shows[q] || !depths.hides(piece);
                for (int y = piece.bottom; y < piece.top; ++y)
                    for (int x = piece.left; x < piece.right; ++x) ++asked[static_cast<std::size_t>(60 * y + x)];
            }
        ASSERT_EQ(next, cuts.plates().size());
        if (allCut) {
            ASSERT_LE(*std::max_element(asked.begin(), asked.end()), 1) << "a pixel is asked for twice";
            ++apart;
        }
        for (const auto& plate : plates) {
            bool hidden = !shows[plate.question];
            for (const std::uint32_t other : cuts.restsOn(plate.question)) hidden = hidden && !shows[other];
            if (!hidden) continue;
            ASSERT_TRUE(depths.hides(plate.plate));
            ++proven;
        }
    }
    EXPECT_GT(proven, 500);
    EXPECT_GT(apart, 1000);
}

}  // namespace
}  // namespace tessera
