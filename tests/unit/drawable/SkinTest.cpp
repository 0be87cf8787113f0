/// Skins: vertices beside the sums in long double; the same bytes along whatever edits; what cannot be a skin is
/// refused by name.
#include "common/drawable/SkinArrays.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>

#include "common/drawable/Drawable.h"
#include "common/geometry/Mesh.h"
#include "tests/property/Seeds.h"
#include "tests/support/words/Words.h"

namespace tessera {
namespace {

float uniformFloat(Random& random, double low, double high) {
    return static_cast<float>(low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53);
}

template <typename Number>
Blob blobOfAll(const std::vector<Number>& numbers) {
    return numbers.empty() ? Blob() : Blob::of(std::span<const Number>(numbers));
}

struct SkinShape {
    std::size_t joints = 4, targets = 2;
    bool normals = true, tangents = true;
};

/// A bent tube, each vertex following up to four joints near it.
Skin someSkin(Random& random, const SkinShape& shape) {
    MeshData mesh = makeTube(1, 0.5, 3, 5 + static_cast<int>(below(random, 6)));
    if (!shape.normals) mesh.normals.clear();
    const std::size_t vertices = mesh.positions.size() / 3;
    Skin skin;
    skin.positions = blobOfAll(mesh.positions);
    skin.normals = blobOfAll(mesh.normals);
    skin.indices = blobOfAll(mesh.indices);
    std::vector<std::uint16_t> indices;
    std::vector<float> weights, deltas, deltaNormals, targetWeights, pose, tangents;
    for (std::size_t k = 0; k < vertices * 4; ++k) {
        // By runs of vertices, so that a joint moves a part of them.
        indices.push_back(
            static_cast<std::uint16_t>(std::min(shape.joints - 1, k / 4 * shape.joints / vertices + below(random, 2))));
        weights.push_back(k % 4 == 0 || oneIn(random, 2) ? uniformFloat(random, 0.01, 2) : 0.0f);
    }
    for (std::size_t i = 0; i < shape.targets * vertices * 3; ++i)
        deltas.push_back(uniformFloat(random, -1, 1)), deltaNormals.push_back(uniformFloat(random, -0.5, 0.5));
    for (std::size_t i = 0; i < shape.targets; ++i)
        targetWeights.push_back(oneIn(random, 4) ? 0.0f : uniformFloat(random, -1, 2));
    for (std::size_t i = 0; i < shape.joints * 12; ++i)
        pose.push_back(uniformFloat(random, -1, 1) + (i % 12 % 5 == 0 ? 1.5f : 0.0f));
    if (shape.joints > 0) skin.jointIndices = blobOfAll(indices), skin.jointWeights = blobOfAll(weights);
    skin.pose = blobOfAll(pose);
    skin.morphPositions = blobOfAll(deltas);
    skin.morphNormals = shape.normals && oneIn(random, 2) ? blobOfAll(deltaNormals) : Blob();
    skin.weights = blobOfAll(targetWeights);
    if (shape.tangents)
        for (std::size_t i = 0; i < vertices; ++i) {
            const Vec3f t =
                Vec3f(uniformFloat(random, 0.1, 1), uniformFloat(random, -1, 1), uniformFloat(random, -1, 1));
            for (const float x : Vec3f(t.normalized())) tangents.push_back(x);
            tangents.push_back(i % 3 == 0 ? -1.0f : 1.0f);
        }
    skin.tangents = blobOfAll(tangents);
    skin.morphTangents = shape.tangents && oneIn(random, 2) ? blobOfAll(deltaNormals) : Blob();
    return skin;
}

MeshArrays arraysOfSkin(const Skin& skin) {
    return drawableOf(Object::of(skin)).arrays();
}
std::string refusalOfSkin(const Skin& skin) {
    const Expected<void> sound = drawableOf(Object::of(skin)).check();
    return sound ? "taken" : sound.error().message;
}

TEST(Skin, VerticesAndNormalsAreWhatTheSumsSay) {
    forSeeds(100, [](Random& random) {
        const SkinShape shape{.joints = below(random, 6), .targets = below(random, 4), .normals = !oneIn(random, 4)};
        const Skin skin = someSkin(random, shape);
        ASSERT_EQ(refusalOfSkin(skin), "taken");
        const MeshArrays arrays = arraysOfSkin(skin);
        const auto rest = skin.positions.as<float>(), restNormals = skin.normals.as<float>(),
                   restTangents = skin.tangents.as<float>(), deltas = skin.morphPositions.as<float>(),
                   deltaNormals = skin.morphNormals.as<float>(), deltaTangents = skin.morphTangents.as<float>();
        const auto joints = skin.jointIndices.as<std::uint16_t>();
        const auto weights = skin.jointWeights.as<float>(), pose = skin.pose.as<float>(),
                   gone = skin.weights.as<float>();
        const auto positions = arrays.positions.as<float>(), normals = arrays.normals.as<float>(),
                   tangents = arrays.tangents.as<float>();
        ASSERT_EQ(tangents.size(), restTangents.size());
        ASSERT_EQ(positions.size(), rest.size());
        ASSERT_EQ(normals.size(), restNormals.size());
        using Wide = Eigen::Matrix<long double, 3, 1>;
        for (std::size_t v = 0; v < rest.size() / 3; ++v) {
            Wide p, n = Wide::Zero(), u;
            for (int c = 0; c < 3; ++c) u[c] = restTangents[4 * v + static_cast<std::size_t>(c)];
            for (int c = 0; c < 3; ++c) p[c] = rest[3 * v + static_cast<std::size_t>(c)];
            for (int c = 0; c < 3 && !restNormals.empty(); ++c) n[c] = restNormals[3 * v + static_cast<std::size_t>(c)];
            for (std::size_t t = 0; t < gone.size(); ++t)
                for (int c = 0; c < 3; ++c) {
                    const std::size_t at = t * rest.size() + 3 * v + static_cast<std::size_t>(c);
                    p[c] += static_cast<long double>(gone[t]) * deltas[at];
                    if (!deltaNormals.empty()) n[c] += static_cast<long double>(gone[t]) * deltaNormals[at];
                    if (!deltaTangents.empty()) u[c] += static_cast<long double>(gone[t]) * deltaTangents[at];
                }
            if (!joints.empty()) {
                Eigen::Matrix<long double, 3, 4> m = Eigen::Matrix<long double, 3, 4>::Zero();
                long double sum = 0;
                for (std::size_t k = 4 * v; k < 4 * v + 4; ++k) sum += weights[k];
                for (std::size_t k = 4 * v; k < 4 * v + 4; ++k)
                    for (int r = 0; r < 3; ++r)
                        for (int c = 0; c < 4; ++c)
                            m(r, c) += weights[k] / sum * pose[joints[k] * 12u + static_cast<unsigned>(4 * r + c)];
                p = (m.leftCols<3>() * p + m.col(3)).eval();
                const Eigen::Matrix<long double, 3, 3> linear = m.leftCols<3>();
                n = (linear.determinant() * linear.inverse().transpose() * n).eval();
                u = (linear * u).eval();
            }
            for (int c = 0; c < 3; ++c)
                ASSERT_NEAR(positions[3 * v + static_cast<std::size_t>(c)], static_cast<double>(p[c]),
                            2e-6 * (1 + static_cast<double>(p.norm())))
                    << "vertex " << v;
            ASSERT_EQ(tangents[4 * v + 3], restTangents[4 * v + 3]);
            const long double along = u.norm();
            for (int c = 0; c < 3 && along > 1e-4L; ++c)
                ASSERT_NEAR(tangents[4 * v + static_cast<std::size_t>(c)], static_cast<double>(u[c] / along), 1e-5);
            // Of a nearly crushed vertex the direction is lost in rounding.
            if (restNormals.empty() || n.norm() < 1e-4L) continue;
            n.normalize();
            for (int c = 0; c < 3; ++c)
                ASSERT_NEAR(normals[3 * v + static_cast<std::size_t>(c)], static_cast<double>(n[c]), 1e-5)
                    << "vertex " << v;
        }
        const Box bounds = drawableOf(Object::of(skin)).bounds();
        for (std::size_t v = 0; v < positions.size() / 3; ++v)
            ASSERT_TRUE(bounds.contains(Vec3d(positions[3 * v], positions[3 * v + 1], positions[3 * v + 2])));
    });
}

TEST(Skin, TheSameBytesAlongWhateverEdits) {
    std::size_t parts = 0;
    forSeeds(60, [&](Random& random) {
        Skin skin = someSkin(random, {.joints = below(random, 3) * 6, .targets = 1 + below(random, 3)});
        std::vector<MeshArrays> kept;  // so that the way there is found again
        kept.push_back(arraysOfSkin(skin));
        for (int step = 0; step < 12; ++step) {
            Blob& moving = skin.pose.empty() || oneIn(random, 4) ? skin.weights : skin.pose;
            const std::size_t numbers = moving.sizeBytes() / 4, first = below(random, numbers),
                              count = 1 + below(random, std::min<std::size_t>(numbers - first, 13));
            std::vector<float> bytes;
            for (std::size_t i = 0; i < count; ++i) bytes.push_back(uniformFloat(random, -2, 2));
            moving = *moving.withRange(4 * first, std::as_bytes(std::span<const float>(bytes)));
            const MeshArrays followed = arraysOfSkin(skin);
            if (followed.positions.id() != kept.back().positions.id())
                for (const Blob::Origin& origin : followed.positions.origins())
                    parts += origin.id == kept.back().positions.id() &&
                             origin.end - origin.begin < followed.positions.sizeBytes();
            kept.push_back(followed);
            // Without the cache, and without a way that led there.
            Skin fresh = skin;
            fresh.pose = Blob::of(skin.pose.as<float>());
            fresh.weights = Blob::of(skin.weights.as<float>());
            if (skin.pose.empty()) fresh.pose = {};
            const DerivedMesh right = kSkinDerivation.derive(&fresh, {}, nullptr);
            ASSERT_EQ(followed.positions.id(), right.arrays.positions.id()) << "step " << step;
            ASSERT_EQ(followed.normals.id(), right.arrays.normals.id()) << "step " << step;
            ASSERT_EQ(followed.tangents.id(), right.arrays.tangents.id()) << "step " << step;
        }
    });
    if (std::getenv("TESSERA_SEED")) return;
    EXPECT_GT(parts, 50u) << "or no edit of a joint led to a part of the vertices";
}

TEST(Skin, AtRestWithoutAPoseAndWhileWeightsAreZero) {
    Random random(3);
    Skin skin = someSkin(random, {});
    skin.inverseBinds = Blob::of(skin.pose.as<float>());  // they say how many joints there are
    skin.pose = {};
    skin.weights = blobOfAll(std::vector<float>{0, 0});
    ASSERT_EQ(refusalOfSkin(skin), "taken");
    const auto rest = skin.positions.as<float>(), shown = arraysOfSkin(skin).positions.as<float>();
    EXPECT_TRUE(std::ranges::equal(rest, shown));
}

TEST(Skin, ACrushedOrHugeOneStaysFinite) {
    Random random(5);
    Skin skin = someSkin(random, {.joints = 3, .targets = 2});
    for (const float number : {0.0f, 1e15f, -1e15f, 1e-38f}) {
        skin.pose = blobOfAll(std::vector<float>(36, number));
        skin.weights = blobOfAll(std::vector<float>{number, number});
        ASSERT_EQ(refusalOfSkin(skin), "taken");
        const MeshArrays arrays = arraysOfSkin(skin);
        ASSERT_FALSE(arrays.positions.empty());
        EXPECT_TRUE(checkMesh(arrays)) << number;
        for (const float coordinate : arrays.positions.as<float>()) ASSERT_TRUE(std::isfinite(coordinate));
        const auto normals = arrays.normals.as<float>();
        for (std::size_t i = 0; i < normals.size(); i += 3)
            ASSERT_NEAR(Vec3f(normals[i], normals[i + 1], normals[i + 2]).norm(), 1, 1e-5) << number;
    }
}

TEST(Skin, WhatCannotBeOneIsRefusedByName) {
    const auto says = [](const std::function<void(Skin&)>& spoil) {
        Random random(7);
        Skin skin = someSkin(random, {});
        ASSERT_EQ(refusalOfSkin(skin), "taken");
        spoil(skin);
        const std::string said = refusalOfSkin(skin);
        EXPECT_NE(said, "taken");
        EXPECT_WORDS(said);
        EXPECT_TRUE(arraysOfSkin(skin).positions.empty()) << "what is refused is not drawn";
    };
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const auto changed = [](const Blob& blob, std::size_t at, auto number) {
        return *blob.withRange(at * sizeof(number), std::as_bytes(std::span<const decltype(number)>(&number, 1)));
    };
    says([&](Skin& s) { s.pose = changed(s.pose, 13, nan); });
    says([&](Skin& s) { s.pose = changed(s.pose, 13, 1e16f); });
    says([&](Skin& s) { s.pose = Blob(Bytes(50)); });
    says([&](Skin& s) { s.inverseBinds = Blob(Bytes(48 * 3)); });
    says([&](Skin& s) { s.joints = {ObjectId(5)}; });
    says([&](Skin& s) { s.pose = {}; });
    says([&](Skin& s) { s.jointIndices = changed(s.jointIndices, 4, std::uint16_t{4}); });
    says([&](Skin& s) { s.jointIndices = Blob(Bytes(8)); });
    says([&](Skin& s) { s.jointWeights = Blob(Bytes(16)); });
    says([&](Skin& s) { s.jointWeights = Blob(Bytes(s.jointWeights.sizeBytes())); });
    says([&](Skin& s) { s.jointWeights = changed(s.jointWeights, 9, -0.5f); });
    says([&](Skin& s) { s.jointWeights = changed(s.jointWeights, 9, nan); });
    says([&](Skin& s) { s.weights = blobOfAll(std::vector<float>{1}); });
    says([&](Skin& s) { s.weights = blobOfAll(std::vector<float>{1, nan}); });
    says([&](Skin& s) { s.morphPositions = Blob(Bytes(12)); });
    says([&](Skin& s) { s.morphPositions = changed(s.morphPositions, 4, nan); });
    says([&](Skin& s) { s.morphNormals = Blob(Bytes(s.positions.sizeBytes())); });
    says([&](Skin& s) { s.morphTangents = Blob(Bytes(s.positions.sizeBytes())); });
    says([&](Skin& s) { s.tangents = Blob(Bytes(16)); });
    says([&](Skin& s) { s.tangents = changed(s.tangents, 4, nan); });
    says([&](Skin& s) { s.positions = changed(s.positions, 4, nan); });
    says([&](Skin& s) { s.indices = changed(s.indices, 0, std::uint32_t{9999}); });
    says([&](Skin& s) { s.pose = Blob::absent(s.pose.id(), s.pose.sizeBytes()); });
    EXPECT_EQ(refusalOfSkin(Skin()), "taken");
}

}  // namespace
}  // namespace tessera
