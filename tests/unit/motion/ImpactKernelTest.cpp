#include "server/collision/query/ImpactKernelTable.h"

#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <random>

#include "server/collision/tree/TreeStorage.h"
#include "tests/unit/motion/Bodies.h"

namespace tessera {
namespace {

using kernel::ImpactFrame;
using kernel::ImpactKernels;

struct Randomness {
    std::mt19937 engine{51};
    std::uniform_real_distribution<float> u{-1, 1};
    float operator()() { return u(engine); }
};

kernel::MovingFrame randomFrame(Randomness& random) {
    kernel::MovingFrame f{};
    const Mat3d rotation = Quatd(random(), random(), random(), random() + 1.5).normalized().toRotationMatrix();
    for (int i = 0; i < 9; ++i) f.linear[i] = f.axes[i] = static_cast<float>(rotation(i / 3, i % 3));
    for (float* part : {f.turning, f.turning + 3, f.turning + 6, f.translation, f.drift})
        for (int k = 0; k < 3; ++k) part[k] = random();
    f.scale = f.stretch = 1;
    f.growth = 0.3f + 0.2f * random();
    f.swelling = 0.1f;
    f.axis[2] = 1;
    f.acceleration = 0.5f + 0.4f * random();
    return f;
}

ImpactFrame randomPair(Randomness& random) {
    ImpactFrame f{randomFrame(random), randomFrame(random), true, 0.1f, 1e-6f, 1e-6f, 0.2f};
    for (float& x : f.b.translation) x *= 3;
    return f;
}

/// Lanes of vectors of any length do the same: what one processor answers, all do, to the last bit.
TEST(ImpactKernels, RoundAlikeOnEveryInstructionSet) {
    Randomness random;
    for (const VolumeKind kind : {VolumeKind::kSphere, VolumeKind::kObb, VolumeKind::kAabb, VolumeKind::kDop18}) {
        const TriangleTree tree(bodies::torus(0.8, 0.3, 40, 30).mesh(), {.volume = kind});
        const TreeStorage& storage = tree.storage();
        const auto shape = static_cast<std::size_t>(shapeOf(kind));
        int positive = 0;
        for (int i = 0; i < 300; ++i) {
            const ImpactFrame f = randomPair(random);
            const auto slot = static_cast<kernel::Slot>(random.engine() % storage.children.size());
            if (storage.children[slot] == kernel::kNoChild) continue;
            const auto node = static_cast<std::uint32_t>(random.engine() % storage.nodeCount());
            const std::size_t leafA = random.engine() % storage.leafCount(),
                              leafB = random.engine() % storage.leafCount();
            struct Answer {
                kernel::PlacedBox box;
                alignas(64) std::array<float, 16> similar, general, faces;
            };
            std::vector<Answer> answers;
            for (const InstructionSet set : {InstructionSet::kSse41, InstructionSet::kAvx2, InstructionSet::kAvx512}) {
                if (set > instructionSet()) continue;
                const ImpactKernels& k = kernel::impactKernels(set);
                Answer& answer = answers.emplace_back();
                k.place[shape](storage.view(), f, f.a, slot, answer.box);
                k.nodeTimes[0][shape](storage.view(), f.b, node, answer.box, f, answer.similar.data());
                k.nodeTimes[1][shape](storage.view(), f.b, node, answer.box, f, answer.general.data());
                k.leafTimes(storage.corners[leafA * kernel::kLeafRows].lane,
                            storage.corners[leafB * kernel::kLeafRows].lane, f, answer.faces.data());
            }
            for (const Answer& answer : answers) {
                ASSERT_EQ(std::memcmp(&answer.box, &answers[0].box, sizeof answer.box), 0);
                ASSERT_EQ(std::memcmp(answer.similar.data(), answers[0].similar.data(), sizeof answer.similar), 0);
                ASSERT_EQ(std::memcmp(answer.general.data(), answers[0].general.data(), sizeof answer.general), 0);
                ASSERT_EQ(std::memcmp(answer.faces.data(), answers[0].faces.data(), sizeof answer.faces), 0);
            }
            positive += answers[0].similar[0] > 0;
        }
        EXPECT_GT(positive, 30);
    }
}

}  // namespace
}  // namespace tessera
