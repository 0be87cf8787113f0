#include "common/cores/Animation.h"
#include "common/cores/DistanceLOD.h"
#include "common/cores/Image.h"
#include "common/cores/Interest.h"
#include "common/cores/Material.h"
#include "common/cores/Motion.h"
#include "common/cores/Switch.h"
#include "common/cores/Transform.h"
#include "server/optimise/SceneOptimiser.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <random>
#include <set>

#include "common/drawable/Drawable.h"
#include "common/geometry/Mesh.h"
#include "common/scene/Action.h"
#include "server/optimise/EqualObjects.h"
#include "server/optimise/MeshOrder.h"

namespace tessera {
namespace {

/// A triangle in the world, as long as the numbers compare: nine, its first corner the least; and its material.
struct WorldTriangle {
    float material = 0;  ///< what it looks like: equal ones become one
    std::array<Vec3d, 3> corners;
    [[nodiscard]] std::array<double, 3> key() const {
        const Vec3d middle = (corners[0] + corners[1] + corners[2]) / 3;
        return {middle.x(), middle.y(), middle.z()};
    }
};

std::vector<WorldTriangle> trianglesOf(const Aspect& scene, bool hidden) {
    std::vector<WorldTriangle> all;
    Action action;
    action.visitHidden(hidden);
    action.on<Geometry>([&](const Visit& visit, const Geometry& mesh) {
        const MeshArrays arrays = drawableOf(Object::of(mesh)).arrays();
        const std::span<const float> at = arrays.positions.as<float>();
        const std::span<const std::uint32_t> corners = arrays.indices.as<std::uint32_t>();
        const bool mirrored = visit.world_T_node.linear().determinant() < 0;
        for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
            const Material* material = mesh.material ? scene.get<Material>(mesh.material) : nullptr;
            WorldTriangle triangle{material ? material->baseColor.x() : -1.0f, {}};
            for (std::size_t k = 0; k < 3; ++k) {
                const std::size_t v = 3 * corners[i + (mirrored && k > 0 ? 3 - k : k)];
                triangle.corners[k] = visit.world_T_node * Vec3d(at[v], at[v + 1], at[v + 2]);
            }
            all.push_back(triangle);
        }
        return Descend::kInto;
    });
    action.run(scene);
    return all;
}

/// The farthest that any triangle is from the one that it has become; infinite where one is missing or has another
/// material or turns around.
double farthest(std::vector<WorldTriangle> before, std::vector<WorldTriangle> after, double cell) {
    if (before.size() != after.size()) return INFINITY;
    // By cells of their middles; a middle near a wall is looked for on both sides.
    std::multimap<std::array<std::int64_t, 3>, std::size_t> grid;
    const auto cellOf = [cell](const std::array<double, 3>& at) {
        return std::array<std::int64_t, 3>{std::int64_t(std::floor(at[0] / cell)),
                                           std::int64_t(std::floor(at[1] / cell)),
                                           std::int64_t(std::floor(at[2] / cell))};
    };
    for (std::size_t i = 0; i < after.size(); ++i) grid.emplace(cellOf(after[i].key()), i);
    std::vector<bool> taken(after.size(), false);
    double worst = 0;
    for (const WorldTriangle& triangle : before) {
        const auto middle = cellOf(triangle.key());
        double best = INFINITY;
        std::size_t bestAt = 0;
        for (int near = 0; near < 27; ++near) {
            const auto range =
                grid.equal_range({middle[0] + near % 3 - 1, middle[1] + near / 3 % 3 - 1, middle[2] + near / 9 - 1});
            for (auto it = range.first; it != range.second; ++it) {
                const WorldTriangle& other = after[it->second];
                if (taken[it->second] || other.material != triangle.material) continue;
                for (std::size_t turn = 0; turn < 3; ++turn) {
                    double apart = 0;
                    for (std::size_t k = 0; k < 3; ++k)
                        apart = std::max(apart,
                                         (triangle.corners[k] - other.corners[(k + turn) % 3]).cwiseAbs().maxCoeff());
                    if (apart < best) {
                        best = apart;
                        bestAt = it->second;
                    }
                }
            }
        }
        if (std::isfinite(best)) taken[bestAt] = true;
        worst = std::max(worst, best);
    }
    return worst;
}

class SceneOfChance {
public:
    explicit SceneOfChance(std::uint64_t seed) : random_(seed) {
        for (int i = 0; i < 3; ++i) {
            Material material;
            material.baseColor.x() = 0.3f * static_cast<float>(i % 2);
            materials_.push_back(add(material));
        }
        for (int i = 0; i < 4; ++i) {
            MeshData data = i % 2 ? makeBox({1, 2, 3}) : makeSphere(1, 6 + 2 * i);
            if (i == 2) data.normals.clear();
            const MeshArrays arrays = data.toArrays();
            Geometry mesh{.positions = arrays.positions,
                          .normals = arrays.normals,
                          .texcoords = arrays.texcoords,
                          .indices = arrays.indices};
            mesh.material = materials_[pick(3)];
            meshes_.push_back(add(mesh));
            meshes_.push_back(add(mesh));  // equal, and another object
        }
        nodes_.push_back(kRootNode);
        for (int i = 0; i < 60; ++i) addNode();
        if (pick(2)) {
            Interest interest;
            interest.object = nodes_[pick(nodes_.size())];
            named_.push_back(interest.object);
            nodeWith(add(interest), kRootNode);
        }
        EXPECT_TRUE(scene.apply(list_.take()));
    }

    Aspect scene;
    std::vector<ObjectId> moved_;  ///< Transforms that motions move
    std::vector<ObjectId> named_;  ///< nodes

private:
    std::size_t pick(std::size_t n) { return random_() % n; }
    double number() { return std::uniform_real_distribution<double>(-3, 3)(random_); }
    template <typename T>
    ObjectId add(const T& value) {
        const ObjectId id{next_++};
        list_.create(id, typeOf<T>());
        setAllFields(list_, id, Object::of(value));
        return id;
    }
    ObjectId nodeWith(ObjectId core, ObjectId parent) {
        const ObjectId id{next_++};
        list_.create(id, typeOf<Node>());
        if (core) list_.set(id, typeOf<Node>(), fieldId<&Node::core>, core);
        list_.set(id, typeOf<Node>(), fieldId<&Node::name>, "n" + std::to_string(id.value));
        list_.place(id, parent);
        return id;
    }
    void addNode() {
        const ObjectId parent = nodes_[pick(nodes_.size())];
        switch (pick(12)) {
            case 0:
                nodes_.push_back(nodeWith(add(Switch{.choice = static_cast<std::int64_t>(pick(4)) - 2}), parent));
                return;
            case 1: {
                const ObjectId core = add(transform());
                nodes_.push_back(nodeWith(core, parent));
                Motion motion;
                motion.target = core;
                moved_.push_back(core);
                nodeWith(add(motion), nodes_.back());
                return;
            }
            case 2:
                nodes_.push_back(nodeWith({}, parent));
                return;
            case 3:
            case 4:
            case 5:
            case 6:
                nodes_.push_back(nodeWith(add(transform()), parent));
                return;
            default:
                nodeWith(meshes_[pick(meshes_.size())], parent);
        }
    }
    Transform transform() {
        Transform t;
        t.translation = Vec3d(number(), number(), number()) * (pick(4) == 0 ? 100 : 1);
        t.rotation = Quatd(number(), number(), number(), number()).normalized();
        if (pick(3) == 0)
            t.scale = Vec3d(0.5 + pick(3), pick(3) == 0 ? -1 : 1, 1);
        else if (pick(2))
            t.scale = Vec3d::Constant(0.5 + pick(3));
        return t;
    }

    std::mt19937_64 random_;
    std::uint64_t next_ = 2;
    ChangeListBuilder list_;
    std::vector<ObjectId> materials_, meshes_, nodes_;
};

std::uint64_t firstSeed() {
    const char* said = std::getenv("TESSERA_SEED");
    return said ? std::strtoull(said, nullptr, 10) : 1;
}

double reachOf(const std::vector<WorldTriangle>& all) {
    double reach = 1;
    for (const WorldTriangle& t : all)
        for (const Vec3d& corner : t.corners) reach = std::max(reach, corner.cwiseAbs().maxCoeff());
    return reach;
}

TEST(Optimiser, TheWorldsTrianglesAreTheSame) {
    std::size_t merged = 0, shared = 0;
    for (std::uint64_t seed = firstSeed(); seed < firstSeed() + 40; ++seed) {
        SceneOfChance chance(seed);
        Aspect& scene = chance.scene;
        const auto before = trianglesOf(scene, false), everything = trianglesOf(scene, true);
        std::map<ObjectId, Affine3d> places;
        for (const ObjectId node : chance.named_) places[node] = worldTransform(scene, node);
        const bool merge = seed % 3 != 0;
        const Expected<OptimiseCounts> counts = optimiseScene(scene, {.merge = merge});
        ASSERT_TRUE(counts) << counts.error().message << "; TESSERA_SEED=" << seed;
        merged += counts->merged;
        shared += counts->shared;
        EXPECT_LE(counts->nodesAfter, counts->nodesBefore) << "TESSERA_SEED=" << seed;
        // Rounded once in coordinates of a node below which scales of at most 2.5 each stand, in chains of a few: their
        // product is in `reach`.
        const double reach = reachOf(everything), tolerance = reach * 8 * 0x1p-24;
        EXPECT_LE(farthest(before, trianglesOf(scene, false), 64 * tolerance), tolerance) << "TESSERA_SEED=" << seed;
        EXPECT_LE(farthest(everything, trianglesOf(scene, true), 64 * tolerance), tolerance)
            << "hidden ones; TESSERA_SEED=" << seed;
        for (const ObjectId core : chance.moved_) EXPECT_TRUE(scene.find(core)) << "TESSERA_SEED=" << seed;
        for (const auto& [node, place] : places) {
            ASSERT_TRUE(scene.find(node)) << "TESSERA_SEED=" << seed;
            EXPECT_EQ(worldTransform(scene, node).matrix(), place.matrix()) << "TESSERA_SEED=" << seed;
        }
        const StateHash once = scene.stateHash();
        const Expected<OptimiseCounts> again = optimiseScene(scene, {.merge = merge, .order = false});
        ASSERT_TRUE(again);
        EXPECT_EQ(scene.stateHash(), once)
            << "a second time changes nothing; TESSERA_SEED=" << seed << "; shared " << again->shared << ", merged "
            << again->merged << ", flattened " << again->flattened << ", nodes " << again->nodesBefore << " to "
            << again->nodesAfter;
    }
    if (firstSeed() == 1) {
        EXPECT_GT(merged, 60u) << "of those under even scales";
        EXPECT_GT(shared, 40u);
    }
}

TEST(Optimiser, WhatMotionsMoveMovesAllThatItDid) {
    for (std::uint64_t seed = firstSeed(); seed < firstSeed() + 20; ++seed) {
        SceneOfChance plain(seed), optimised(seed);
        ASSERT_TRUE(optimiseScene(optimised.scene, {.merge = true}));
        for (Aspect* scene : {&plain.scene, &optimised.scene}) {
            ChangeListBuilder list;
            for (const ObjectId core : plain.moved_)
                list.set(core, typeOf<Transform>(), fieldId<&Transform::translation>, toValue(Vec3d(7, -5, 2)));
            ASSERT_TRUE(scene->apply(list.take()));
        }
        const auto before = trianglesOf(plain.scene, true);
        const double tolerance = reachOf(before) * 8 * 0x1p-24;
        EXPECT_LE(farthest(before, trianglesOf(optimised.scene, true), 64 * tolerance), tolerance)
            << "TESSERA_SEED=" << seed;
    }
}

TEST(Optimiser, AChainOfTransformsBecomesOne) {
    for (const bool sheared : {false, true}) {
        Aspect scene;
        ChangeListBuilder list;
        const MeshArrays box = makeBox({1, 2, 3}).toArrays();
        list.create(ObjectId{2}, typeOf<Geometry>());
        setAllFields(list, ObjectId{2},
                     Object::of(Geometry{.positions = box.positions,
                                         .normals = box.normals,
                                         .texcoords = box.texcoords,
                                         .indices = box.indices}));
        ObjectId parent = kRootNode;
        for (std::uint64_t i = 0; i < 3; ++i) {
            Transform transform;
            transform.translation = Vec3d(1, 2, 3);
            transform.rotation = Quatd(1, 0.2, 0.3 * static_cast<double>(i), 0.1).normalized();
            if (i == 0) transform.scale = sheared ? Vec3d(1, 3, 1) : Vec3d(2, 2, 2);
            list.create(ObjectId{10 + i}, typeOf<Transform>());
            setAllFields(list, ObjectId{10 + i}, Object::of(transform));
            list.create(ObjectId{20 + i}, typeOf<Node>());
            list.set(ObjectId{20 + i}, typeOf<Node>(), fieldId<&Node::core>, ObjectId{10 + i});
            list.place(ObjectId{20 + i}, parent);
            parent = ObjectId{20 + i};
        }
        list.create(ObjectId{30}, typeOf<Node>());
        list.set(ObjectId{30}, typeOf<Node>(), fieldId<&Node::core>, ObjectId{2});
        list.place(ObjectId{30}, parent);
        ASSERT_TRUE(scene.apply(list.take()));
        const auto before = trianglesOf(scene, false);
        const Expected<OptimiseCounts> counts = optimiseScene(scene, {});
        ASSERT_TRUE(counts);
        EXPECT_EQ(counts->flattened, sheared ? 0u : 1u) << "a shear is no Transform";
        EXPECT_EQ(counts->nodesAfter, sheared ? 5u : 3u);
        EXPECT_LE(farthest(before, trianglesOf(scene, false), 0.1), 1e-12);
    }
}

/// What hides much is found by its own box: as a part of a mesh that reaches through the hall it would hide next to
/// nothing.
TEST(Optimiser, WallsStayByThemselves) {
    Aspect scene;
    ChangeListBuilder list;
    const auto shape = [&](std::uint64_t id, const Vec3d& size) {
        const MeshArrays box = makeBox(size).toArrays();
        list.create(ObjectId{id}, typeOf<Geometry>());
        setAllFields(list, ObjectId{id},
                     Object::of(Geometry{.positions = box.positions,
                                         .normals = box.normals,
                                         .texcoords = box.texcoords,
                                         .indices = box.indices}));
    };
    shape(2, {6, 4, 0.2});
    shape(3, {0.2, 0.3, 0.2});
    shape(4, {19, 0.1, 0.1});  // long and thin: it hides little
    std::uint64_t next = 10;
    const auto put = [&](std::uint64_t core, const Vec3d& at) {
        const ObjectId place{next++}, node{next++}, below{next++};
        list.create(place, typeOf<Transform>());
        list.set(place, typeOf<Transform>(), fieldId<&Transform::translation>, toValue(at));
        list.create(node, typeOf<Node>());
        list.set(node, typeOf<Node>(), fieldId<&Node::core>, place);
        list.place(node, kRootNode);
        list.create(below, typeOf<Node>());
        list.set(below, typeOf<Node>(), fieldId<&Node::core>, ObjectId{core});
        list.place(below, node);
        return below;
    };
    const ObjectId wall = put(2, {0, 2, -3}), other = put(2, {7, 2, 4});
    for (int i = 0; i < 40; ++i) put(3, {i % 8 * 2.5 - 9, 0.2, i / 8 * 4.0 - 9});
    put(4, {0, 3.9, 0});
    ASSERT_TRUE(scene.apply(list.take()));
    const auto before = trianglesOf(scene, false);
    const Expected<OptimiseCounts> counts = optimiseScene(scene, {.merge = true, .flatten = false});
    ASSERT_TRUE(counts);
    EXPECT_EQ(counts->merged, 41u);
    EXPECT_EQ(counts->mergedInto, 1u);
    for (const ObjectId node : {wall, other}) EXPECT_TRUE(scene.find(node)) << "a wall is part of something else";
    EXPECT_LE(farthest(before, trianglesOf(scene, false), 1e-3), 20 * 0x1p-24);
}

/// Nor does what collides with itself become one mesh, nor what has normals under an uneven scale: both would be
/// something else.
TEST(Optimiser, MeshesThatWouldNotBeTheSameStayApart) {
    for (const bool uneven : {false, true})
        for (const bool self : {false, true}) {
            Aspect scene;
            ChangeListBuilder list;
            const MeshArrays box = makeBox({0.1, 0.1, 0.1}).toArrays();
            list.create(ObjectId{2}, typeOf<Geometry>());
            setAllFields(list, ObjectId{2},
                         Object::of(Geometry{.positions = box.positions,
                                             .normals = box.normals,
                                             .texcoords = box.texcoords,
                                             .indices = box.indices}));
            const ObjectId group{3};
            list.create(group, typeOf<Node>());
            list.place(group, kRootNode);
            for (std::uint64_t i = 0; i < 20; ++i) {
                const ObjectId core{10 + i}, node{40 + i}, below{70 + i};
                list.create(core, typeOf<Transform>());
                list.set(core, typeOf<Transform>(), fieldId<&Transform::translation>,
                         toValue(Vec3d(static_cast<double>(i), 0, 0)));
                list.set(core, typeOf<Transform>(), fieldId<&Transform::scale>,
                         toValue(uneven ? Vec3d(1, 2, 1) : Vec3d(2, 2, 2)));
                list.create(node, typeOf<Node>());
                list.set(node, typeOf<Node>(), fieldId<&Node::core>, core);
                list.place(node, group);
                list.create(below, typeOf<Node>());
                list.set(below, typeOf<Node>(), fieldId<&Node::core>, ObjectId{2});
                list.place(below, node);
            }
            if (self) {
                const ObjectId interest{100}, node{101};
                list.create(interest, typeOf<Interest>());
                list.set(interest, typeOf<Interest>(), fieldId<&Interest::object>, group);
                list.set(interest, typeOf<Interest>(), fieldId<&Interest::mode>, Interest::kSelf);
                list.create(node, typeOf<Node>());
                list.set(node, typeOf<Node>(), fieldId<&Node::core>, interest);
                list.place(node, kRootNode);
            }
            ASSERT_TRUE(scene.apply(list.take()));
            const Expected<OptimiseCounts> counts = optimiseScene(scene, {.merge = true, .flatten = false});
            ASSERT_TRUE(counts);
            EXPECT_EQ(counts->merged, uneven || self ? 0u : 20u) << "uneven " << uneven << ", self " << self;
        }
}

TEST(Optimiser, KeepsWhatItIsTold) {
    SceneOfChance chance(3);
    Aspect& scene = chance.scene;
    const Node& root = scene.root();
    ASSERT_FALSE(root.children.empty());
    std::string kept;
    std::size_t below = 0;
    ObjectId top;
    for (const ObjectId child : root.children) {
        std::vector<ObjectId> open{child};
        std::size_t count = 0;
        while (!open.empty()) {
            const ObjectId node = open.back();
            open.pop_back();
            ++count;
            for (const ObjectId next : scene.get<Node>(node)->children) open.push_back(next);
        }
        if (count <= below) continue;
        below = count;
        kept = pathOf(scene, child);
        top = child;
    }
    ASSERT_TRUE(optimiseScene(scene, {.share = false, .merge = true, .order = false, .levels = false, .keep = {kept}}));
    std::size_t count = 0;
    std::vector<ObjectId> open{top};
    while (!open.empty()) {
        const ObjectId node = open.back();
        open.pop_back();
        ++count;
        for (const ObjectId next : scene.get<Node>(node)->children) open.push_back(next);
    }
    EXPECT_EQ(count, below);
    EXPECT_FALSE(optimiseScene(scene, {.keep = {"/nowhere"}}));
}

TEST(Optimiser, EqualObjectsBecomeOneButForWhatSomebodyMeans) {
    Aspect scene;
    ChangeListBuilder list;
    for (std::uint64_t i = 0; i < 3; ++i) {
        Image image{.pixels = Blob::of(std::span<const std::uint8_t>(std::vector<std::uint8_t>{1, 2, 3, 4})),
                    .widthPx = 1,
                    .heightPx = 1};
        Material material;
        material.baseColorImage = ObjectId{10 + i};
        list.create(ObjectId{10 + i}, typeOf<Image>());
        setAllFields(list, ObjectId{10 + i}, Object::of(image));
        list.create(ObjectId{20 + i}, typeOf<Material>());
        setAllFields(list, ObjectId{20 + i}, Object::of(material));
    }
    KeyFrames frames;
    frames.target = ObjectId{22};
    list.create(ObjectId{30}, typeOf<KeyFrames>());
    setAllFields(list, ObjectId{30}, Object::of(frames));
    ASSERT_TRUE(scene.apply(list.take()));
    const Expected<std::size_t> gone = shareEqualObjects(scene);
    ASSERT_TRUE(gone);
    EXPECT_EQ(*gone, 3u) << "two images and the material that no animation means";
    EXPECT_FALSE(scene.find(ObjectId{21}));
    EXPECT_TRUE(scene.find(ObjectId{22}));
    EXPECT_EQ(scene.get<Material>(ObjectId{22})->baseColorImage, ObjectId{10});
}

/// Corners of each triangle with all that they have, the least corner first; sorted.
std::vector<std::array<std::vector<float>, 3>> cornersWithAll(const Geometry& mesh) {
    std::vector<std::array<std::vector<float>, 3>> all;
    const auto corner = [&](std::uint32_t v) {
        std::vector<float> values;
        for (const auto& [blob, each] : {std::pair{&mesh.positions, 3u}, {&mesh.normals, 3u}, {&mesh.texcoords, 2u}})
            if (!blob->empty())
                for (unsigned k = 0; k < each; ++k) values.push_back(blob->as<float>()[each * v + k]);
        return values;
    };
    const std::span<const std::uint32_t> indices = mesh.indices.as<std::uint32_t>();
    for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
        std::array<std::vector<float>, 3> triangle{corner(indices[i]), corner(indices[i + 1]), corner(indices[i + 2])};
        std::rotate(triangle.begin(), std::min_element(triangle.begin(), triangle.end()), triangle.end());
        all.push_back(triangle);
    }
    std::ranges::sort(all);
    return all;
}

Geometry meshOf(const MeshData& data) {
    const MeshArrays arrays = data.toArrays();
    return {.positions = arrays.positions,
            .normals = arrays.normals,
            .texcoords = arrays.texcoords,
            .indices = arrays.indices};
}

TEST(MeshOrder, TheSameTrianglesCornerByCorner) {
    std::mt19937 random(5);
    MeshData sphere = makeSphere(1, 64);
    for (int i = 0; i < 300; ++i) {  // shuffled, so that there is something to win
        const std::size_t a = 3 * (random() % (sphere.indices.size() / 3)),
                          b = 3 * (random() % (sphere.indices.size() / 3));
        std::swap_ranges(sphere.indices.begin() + static_cast<std::ptrdiff_t>(a),
                         sphere.indices.begin() + static_cast<std::ptrdiff_t>(a) + 3,
                         sphere.indices.begin() + static_cast<std::ptrdiff_t>(b));
    }
    // Each triangle with vertices of its own: they are joined again.
    MeshData loose;
    for (const std::uint32_t i : sphere.indices) {
        loose.positions.insert(loose.positions.end(), &sphere.positions[3 * i], &sphere.positions[3 * i] + 3);
        loose.normals.insert(loose.normals.end(), &sphere.normals[3 * i], &sphere.normals[3 * i] + 3);
        loose.indices.push_back(static_cast<std::uint32_t>(loose.indices.size()));
    }
    for (const MeshData& data : {sphere, loose})
        for (const bool spatial : {false, true}) {
            const Geometry mesh = meshOf(data), better = ordered(mesh, spatial);
            EXPECT_EQ(cornersWithAll(better), cornersWithAll(mesh));
            EXPECT_TRUE(drawableOf(Object::of(better)).check());
            EXPECT_LE(better.positions.sizeBytes(), sphere.positions.size() * sizeof(float));
        }
}

double distanceToTriangle(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
    // C. Ericson, "Real-Time Collision Detection", 2005, 5.1.5, by clamping over a fine grid would be slow: the exact
    // cases.
    const Vec3d ab = b - a, ac = c - a, n = ab.cross(ac);
    const auto segment = [&p](const Vec3d& u, const Vec3d& v) {
        const double t = std::clamp((p - u).dot(v - u) / std::max((v - u).squaredNorm(), 1e-300), 0.0, 1.0);
        return (p - u - t * (v - u)).norm();
    };
    double best = std::min({segment(a, b), segment(b, c), segment(c, a)});
    if (n.squaredNorm() > 0) {
        const Vec3d w = p - a;
        const double u = ab.cross(w).dot(n) / n.squaredNorm(), v = w.cross(ac).dot(n) / n.squaredNorm();
        if (u >= 0 && v >= 0 && u + v <= 1) best = std::min(best, std::abs(w.dot(n)) / n.norm());
    }
    return best;
}

TEST(MeshOrder, CoarserMeshesAreAboutAsFarOffAsTheySay) {
    const Geometry fine = meshOf(makeTorus(1, 0.35, 64, 32));
    const std::vector<CoarserMesh> coarser = coarserMeshes(fine, 200);
    ASSERT_GE(coarser.size(), 3u);
    std::size_t before = fine.indices.sizeBytes();
    double error = 0;
    for (const CoarserMesh& level : coarser) {
        EXPECT_LE(level.mesh.indices.sizeBytes(), before * 3 / 4);
        EXPECT_GE(level.error, error);
        before = level.mesh.indices.sizeBytes();
        error = level.error;
        const std::span<const float> at = level.mesh.positions.as<float>(), from = fine.positions.as<float>();
        const std::span<const std::uint32_t> corners = level.mesh.indices.as<std::uint32_t>();
        const auto vertex = [](std::span<const float> all, std::size_t i) {
            return Vec3d(all[3 * i], all[3 * i + 1], all[3 * i + 2]);
        };
        double farthestVertex = 0;
        for (std::size_t v = 0; v < from.size() / 3; v += 3) {
            double nearest = INFINITY;
            for (std::size_t i = 0; i < corners.size(); i += 3)
                nearest = std::min(nearest, distanceToTriangle(vertex(from, v), vertex(at, corners[i]),
                                                               vertex(at, corners[i + 1]), vertex(at, corners[i + 2])));
            farthestVertex = std::max(farthestVertex, nearest);
        }
        // The simplification's own is a quadratic mean over planes: what is measured is some times as much.
        EXPECT_LE(farthestVertex, 4 * level.error) << corners.size() / 3;
        EXPECT_GE(farthestVertex, 0.1 * level.error) << corners.size() / 3;
        RecordProperty("apart_of_said_" + std::to_string(corners.size() / 3),
                       std::to_string(farthestVertex / level.error));
    }
}

TEST(Optimiser, LevelsShowTheFinestFirstAndCollideAsIt) {
    Aspect scene;
    ChangeListBuilder list;
    list.create(ObjectId{2}, typeOf<Geometry>());
    setAllFields(list, ObjectId{2}, Object::of(meshOf(makeTorus(1, 0.35, 96, 48))));
    for (std::uint64_t i = 0; i < 2; ++i) {
        list.create(ObjectId{10 + i}, typeOf<Node>());
        list.set(ObjectId{10 + i}, typeOf<Node>(), fieldId<&Node::core>, ObjectId{2});
        list.place(ObjectId{10 + i}, kRootNode);
    }
    ASSERT_TRUE(scene.apply(list.take()));
    const auto before = trianglesOf(scene, false);
    const Expected<OptimiseCounts> counts =
        optimiseScene(scene, {.merge = false, .flatten = false, .order = false, .levels = true});
    ASSERT_TRUE(counts) << counts.error().message;
    EXPECT_EQ(counts->levelled, 1u);
    EXPECT_GE(counts->levels, 2u);
    const auto* lod = scene.coreOf<DistanceLOD>(*scene.get<Node>(ObjectId{10}));
    ASSERT_TRUE(lod);
    EXPECT_EQ(lod, scene.coreOf<DistanceLOD>(*scene.get<Node>(ObjectId{11}))) << "one core for both";
    EXPECT_EQ(scene.get<Node>(ObjectId{10})->children.size(), counts->levels + 1);
    EXPECT_EQ(farthest(before, trianglesOf(scene, false), 1e-3), 0);
    EXPECT_GT(trianglesOf(scene, true).size(), before.size());
}

}  // namespace
}  // namespace tessera
