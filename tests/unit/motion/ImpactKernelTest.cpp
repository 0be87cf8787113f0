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
            ImpactFrame f = randomPair(random);
            if (i % 2 == 1) f.thickness = 0.1f, f.thickening = 0.05f * random();
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

/// All faces below a slot, in the tree's own coordinates.
void collect(const TreeStorage& tree, kernel::ChildRef ref, std::vector<Triangle>& out) {
    if ((ref & kernel::kLeafBit) == 0) {
        for (kernel::Slot i = 0; i < kernel::kWidth; ++i)
            if (tree.children[ref * kernel::kWidth + i] != kernel::kNoChild)
                collect(tree, tree.children[ref * kernel::kWidth + i], out);
        return;
    }
    const std::size_t leaf = (ref & ~kernel::kLeafBit) >> 2;
    for (unsigned i = 0; i <= (ref & 3); ++i) {
        Triangle t = tree.mesh->triangle(tree.leafFaces[leaf * kernel::kLeafFaces + i]);
        for (Vec3d& p : t) p = (p - tree.centre) * tree.unit;
        out.push_back(t);
    }
}

Vec3d mapped(const float* m, const float* t, const Vec3d& x) {
    Vec3d out;
    for (int i = 0; i < 3; ++i)
        out[i] = double{m[3 * i]} * x.x() + double{m[3 * i + 1]} * x.y() + double{m[3 * i + 2]} * x.z() + double{t[i]};
    return out;
}

std::vector<Triangle> after(double s, const kernel::MovingFrame& f, const std::vector<Triangle>& faces) {
    std::vector<Triangle> out = faces;
    for (Triangle& t : out)
        for (Vec3d& p : t) p = mapped(f.linear, f.translation, p) + s * mapped(f.turning, f.drift, p);
    return out;
}

/// Sheared, flattened and scaled maps too: their boxes are no boxes any more.
kernel::MovingFrame affineFrame(Randomness& random, bool similarity) {
    kernel::MovingFrame f = randomFrame(random);
    Mat3d linear;
    for (int i = 0; i < 9; ++i) linear(i / 3, i % 3) = static_cast<double>(f.linear[i]);
    if (similarity) {
        f.scale = 0.6f + 0.4f * random();
        linear *= static_cast<double>(f.scale);
    } else {
        linear = linear * Vec3d(random(), random(), random()).asDiagonal();
        linear.col(1) += linear.col(0) * static_cast<double>(random());
    }
    double turning = 0;
    for (int i = 0; i < 9; ++i) {
        f.linear[i] = static_cast<float>(linear(i / 3, i % 3));
        if (!similarity) f.axes[i] = f.linear[i];
        turning += static_cast<double>(f.turning[i]) * static_cast<double>(f.turning[i]);
    }
    f.stretch = static_cast<float>(1.00001 * (similarity ? static_cast<double>(f.scale) : linear.norm()));
    f.growth = f.swelling = static_cast<float>(1.00001 * std::sqrt(turning));
    f.acceleration = 0;
    return f;
}

/// What moves straight does not meet before the time that is promised for its volumes and for its faces.
TEST(ImpactKernels, PromiseNoMoreTimeThanThereIs) {
    Randomness random;
    const ImpactKernels& kernels = kernel::impactKernels();
    for (const VolumeKind kind : {VolumeKind::kSphere, VolumeKind::kObb, VolumeKind::kAabb, VolumeKind::kDop14}) {
        const TriangleTree treeA(bodies::torus(0.8, 0.3, 24, 14).mesh(), {.volume = kind});
        const TriangleTree treeB(bodies::sphere(0.7, 16, 20).mesh(), {.volume = kind});
        const TreeStorage &a = treeA.storage(), &b = treeB.storage();
        const auto shape = static_cast<std::size_t>(shapeOf(kind));
        int promised = 0;
        for (int i = 0; i < 1500; ++i) {
            const bool similarity = i % 4 == 0;
            ImpactFrame f{
                affineFrame(random, similarity), affineFrame(random, similarity), similarity, 0, 5e-6f, 5e-6f, 1};
            for (float& x : f.b.translation) x *= similarity ? 1.5f : 0.8f;
            const auto slot = static_cast<kernel::Slot>(random.engine() % a.children.size());
            if (a.children[slot] == kernel::kNoChild) continue;
            const auto node = static_cast<std::uint32_t>(random.engine() % b.nodeCount());
            std::vector<Triangle> facesA;
            collect(a, a.children[slot], facesA);
            kernel::PlacedBox box;
            alignas(64) std::array<float, 16> times;
            kernels.place[shape](a.view(), f, f.a, slot, box);
            kernels.nodeTimes[similarity ? 0 : 1][shape](b.view(), f.b, node, box, f, times.data());
            for (kernel::Slot lane = 0; lane < kernel::kWidth; ++lane) {
                const kernel::ChildRef child = b.children[node * kernel::kWidth + lane];
                if (child == kernel::kNoChild || !(times[lane] > 0)) continue;
                ++promised;
                std::vector<Triangle> facesB;
                collect(b, child, facesB);
                for (const double part : {0.0, 0.5, 0.9999}) {
                    const double s = part * std::min(1e3, static_cast<double>(times[lane]));
                    ASSERT_FALSE(bodies::touching(after(s, f.a, facesA), after(s, f.b, facesB)))
                        << "kind " << static_cast<int>(kind) << ", trial " << i << ", lane " << lane << ", after " << s;
                }
            }
        }
        EXPECT_GT(promised, 100);
    }
}

/// Standing still but for an acceleration of 2, two volumes are apart for the square root of their gap: no more than
/// what is between the faces in them.
TEST(ImpactKernels, SeeNoWiderGapThanThereIs) {
    Randomness random;
    const ImpactKernels& kernels = kernel::impactKernels();
    for (const VolumeKind kind : {VolumeKind::kSphere, VolumeKind::kObb, VolumeKind::kAabb, VolumeKind::kDop14}) {
        const TriangleTree treeA(bodies::torus(0.8, 0.3, 24, 14).mesh(), {.volume = kind});
        const TriangleTree treeB(bodies::sphere(0.7, 16, 20).mesh(), {.volume = kind});
        const TreeStorage &a = treeA.storage(), &b = treeB.storage();
        const auto shape = static_cast<std::size_t>(shapeOf(kind));
        int compared = 0;
        for (int i = 0; compared < 6000; ++i) {
            const bool similarity = i % 4 == 0;
            ImpactFrame f{affineFrame(random, similarity), affineFrame(random, similarity), similarity, 2, 5e-6f, 0, 1};
            for (kernel::MovingFrame* m : {&f.a, &f.b}) {
                for (float& x : m->turning) x = 0;
                for (float& x : m->drift) x = 0;
                m->growth = m->swelling = 0;
            }
            const auto slot = static_cast<kernel::Slot>(random.engine() % a.children.size());
            const auto node = static_cast<std::uint32_t>(random.engine() % b.nodeCount());
            if (a.children[slot] == kernel::kNoChild) continue;
            std::vector<Triangle> facesA;
            collect(a, a.children[slot], facesA);
            if (facesA.size() > 30) continue;
            kernel::PlacedBox box;
            alignas(64) std::array<float, 16> times;
            kernels.place[shape](a.view(), f, f.a, slot, box);
            kernels.nodeTimes[similarity ? 0 : 1][shape](b.view(), f.b, node, box, f, times.data());
            for (kernel::Slot lane = 0; lane < kernel::kWidth; ++lane) {
                const kernel::ChildRef child = b.children[node * kernel::kWidth + lane];
                if (child == kernel::kNoChild) continue;
                std::vector<Triangle> facesB;
                collect(b, child, facesB);
                if (facesB.size() > 30) continue;
                ++compared;
                const double gap = static_cast<double>(times[lane]) * static_cast<double>(times[lane]);
                ASSERT_LE(gap, bodies::distance(after(0, f.a, facesA), after(0, f.b, facesB)))
                    << "kind " << static_cast<int>(kind) << ", trial " << i << ", lane " << lane;
            }
        }
    }
}

}  // namespace
}  // namespace tessera
