// One shape, asked by several threads at once: each gets what it gets alone.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <limits>
#include <optional>
#include <thread>

#include "common/math/Compose.h"
#include "tests/unit/freeform_query/SmoothBodies.h"

namespace tessera::test {
namespace {

/// Creases of many sharpnesses: hundreds of kinds of neighbourhoods, most of which only queries ask for.
ControlMesh creasedBody(Chance& chance, bool loop) {
    ControlMesh mesh = lumpyCube(chance, 3, 0.2);
    if (loop) mesh = asTriangles(mesh);
    const std::size_t corners = loop ? 3 : 4;
    for (std::size_t f = 0; f < mesh.faceSizes.size(); f += 2)
        mesh.creases.push_back({mesh.faceVertices[corners * f], mesh.faceVertices[corners * f + 1],
                                static_cast<float>(chance.uniform(0.5, 6))});
    return mesh;
}

std::vector<double> askAll(const FreeformShape& a, const FreeformShape& b, const std::vector<Affine3d>& poses) {
    FreeformPair pair(a, b);
    std::vector<double> out;
    for (const Affine3d& pose : poses) {
        QueryWork work;
        const FreeformTouch touch = pair.touch(pose, 1e-6, work);
        const FreeformDistance distance = pair.distance(pose, work, {.tolerance = 1e-6});
        const FreeformContacts contacts = pair.contacts(pose, work, {.tolerance = 1e-4, .spacing = 0.2, .most = 50});
        out.insert(out.end(), {static_cast<double>(touch.touch), distance.distance, distance.least, distance.a.u,
                               distance.b.v, static_cast<double>(contacts.contacts.size())});
    }
    return out;
}

TEST(FreeformManyReaders, EachGetsWhatItGetsAlone) {
    constexpr std::size_t kThreads = 4;
    for (const std::uint64_t seed : seedsOf(3)) {
        SCOPED_TRACE(repeat(seed));
        Chance chance(seed);
        const ControlMesh controlA = creasedBody(chance, false), controlB = creasedBody(chance, seed % 2 == 1);
        std::vector<Affine3d> poses;
        for (int i = 0; i < 5; ++i)
            poses.push_back(
                composeTransform(chance.uniform(0.5, 2.5) * chance.direction(), chance.rotation(), Vec3d::Ones()));
        // Shapes that nobody has asked anything yet, so that threads meet where nothing is known.
        const FreeformShape a = FreeformShape::ofSubdivision(controlA).value(),
                            b = FreeformShape::ofSubdivision(controlB).value();
        std::vector<std::vector<double>> together(kThreads);
        {
            std::atomic<std::size_t> ready{0};
            std::vector<std::jthread> threads;
            for (std::size_t t = 0; t < kThreads; ++t)
                threads.emplace_back([&, t] {
                    ++ready;
                    while (ready.load() < kThreads) std::this_thread::yield();
                    together[t] = askAll(a, b, poses);
                });
        }
        const std::vector<double> alone = askAll(FreeformShape::ofSubdivision(controlA).value(),
                                                 FreeformShape::ofSubdivision(controlB).value(), poses);
        for (const std::vector<double>& one : together) EXPECT_EQ(one, alone);
    }
}

TEST(FreeformManyReaders, ABodyOfTheSameMeshIsWhatItWouldBeAlone) {
    for (const std::uint64_t seed : seedsOf(3)) {
        SCOPED_TRACE(repeat(seed));
        Chance chance(seed);
        ControlMesh control = creasedBody(chance, seed % 2 == 1);
        const FreeformShape other = FreeformShape::ofSubdivision(lumpyCube(chance, 2, 0.2)).value();
        std::optional<FreeformShape> first = FreeformShape::ofSubdivision(control).value();
        for (Vec3d& p : control.positions) p *= chance.uniform(0.9, 1.1);
        FreeformShape second = first->withPositions(control.positions).value();
        EXPECT_EQ(second.subdivision()->graph, first->subdivision()->graph);
        const std::vector<Affine3d> poses{composeTransform(1.2 * chance.direction(), chance.rotation(), Vec3d::Ones()),
                                          composeTransform(2.5 * chance.direction(), chance.rotation(), Vec3d::Ones())};
        const auto alone = [&] { return askAll(FreeformShape::ofSubdivision(control).value(), other, poses); };
        EXPECT_EQ(askAll(second, other, poses), alone());
        // Neither minds what becomes of the other.
        std::vector<Vec3d> far = control.positions;
        for (Vec3d& p : far) p += Vec3d(100, 0, 0);
        ASSERT_TRUE(first->move(far));
        first.reset();
        EXPECT_EQ(askAll(second, other, poses), alone());
    }
}

TEST(FreeformManyReaders, OtherBodiesOfNoMeshAreRefused) {
    const FreeformShape ball = sphere(1);
    EXPECT_FALSE(ball.withPositions({}));
    Chance chance(1);
    const ControlMesh control = lumpyCube(chance, 2, 0.2);
    const FreeformShape body = FreeformShape::ofSubdivision(control).value();
    std::vector<Vec3d> positions = control.positions;
    positions[3].y() = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(body.withPositions(positions));
    positions.resize(5);
    EXPECT_FALSE(body.withPositions(positions));
}

/// Where faces begin and which way edges were named first says nothing of a surface.
TEST(FreeformManyReaders, KindsDoNotDependOnHowAMeshIsNumbered) {
    for (const std::uint64_t seed : seedsOf(4)) {
        SCOPED_TRACE(repeat(seed));
        Chance chance(seed);
        ControlMesh cube = lumpyCube(chance, 1, 0);
        const auto kinds = [](const ControlMesh& mesh) {
            const SubdivisionTopology topology = SubdivisionTopology::build(mesh).value();
            NeighbourhoodGraph graph(topology);
            for (std::uint32_t f = 0; f < topology.mesh().faceCount(); ++f) (void)graph.faceOf(f);
            return graph.nodeCount();
        };
        EXPECT_EQ(kinds(cube), 1U);
        for (std::size_t f = 0; f < 6; ++f) {
            const auto begin = cube.faceVertices.begin() + static_cast<std::ptrdiff_t>(4 * f);
            std::rotate(begin, begin + static_cast<std::ptrdiff_t>(chance.engine() % 4), begin + 4);
        }
        EXPECT_EQ(kinds(cube), 1U);
    }
}

TEST(FreeformManyReaders, KindsOfNeighbourhoodsAreMadeOnce) {
    for (const std::uint64_t seed : seedsOf(4)) {
        SCOPED_TRACE(repeat(seed));
        Chance chance(seed);
        const ControlMesh control = creasedBody(chance, seed % 2 == 1);
        const SubdivisionTopology topology = SubdivisionTopology::build(control).value();
        const auto goThrough = [&](NeighbourhoodGraph& graph) {
            for (std::uint32_t f = 0; f < topology.mesh().faceCount(); ++f) {
                const NeighbourhoodGraph::Node* node = graph.faceOf(f).node;
                for (std::uint32_t depth = 0; depth < 8; ++depth) {
                    (void)graph.limitAt(*node, 0);
                    node = graph.childOf(*node, depth % 4).node;
                }
            }
        };
        NeighbourhoodGraph alone(topology), together(topology);
        goThrough(alone);
        {
            std::vector<std::jthread> threads;
            for (int t = 0; t < 4; ++t) threads.emplace_back([&] { goThrough(together); });
        }
        EXPECT_EQ(together.nodeCount(), alone.nodeCount());
        EXPECT_GT(alone.nodeCount(), 20U) << "or threads had nothing to meet over";
    }
}

}  // namespace
}  // namespace tessera::test
