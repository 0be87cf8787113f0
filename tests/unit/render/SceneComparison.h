/// Whether two RenderScenes know the same, to the bit.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <cstring>
#include <map>
#include <string>

#include "client/render/scene/SceneItems.h"

namespace tessera {

/// What is known of an item, in comparable form.
inline std::string describe(const SceneItem& item, const Box& box) {
    std::string text;
    const auto number = [&](double value) {
        char buffer[32];
        std::snprintf(buffer, sizeof buffer, "%a ", value + 0.0);
        text += buffer;
    };
    text += std::to_string(item.geometry.value) + " " + std::to_string(item.material.value) + " ";
    text += item.mirrored ? "mirrored " : "";
    text += item.transparent ? "transparent " : "";
    text += item.occludes ? "occludes " : "";
    text += toHex(item.mesh->arrays().positions.id()) + toHex(item.mesh->arrays().indices.id()) + " ";
    number(static_cast<double>(item.mesh->triangles));
    number(item.reach);
    text += "seen by " + std::to_string(item.seenBy) + " ";
    const Affine3d& world = item.world_T_item;
    std::array<std::uint64_t, 16> bits{};
    std::memcpy(bits.data(), world.data(), sizeof bits);
    for (const std::uint64_t b : bits) text += std::to_string(b) + " ";
    for (const double v : {box.lower.x(), box.lower.y(), box.lower.z(), box.upper.x(), box.upper.y(), box.upper.z()})
        number(v);
    return text;
}

inline std::map<std::uint64_t, std::string> itemsOf(const RenderScene& scene) {
    const RenderScene::Impl& all = scene.impl();
    std::map<std::uint64_t, std::string> found;
    for (std::size_t i = 0; i < all.items.size(); ++i) {
        if (!all.items[i].node) {
            EXPECT_TRUE(all.boxes[i].empty());
            continue;
        }
        EXPECT_TRUE(found.emplace(all.items[i].node.value, describe(all.items[i], all.boxes[i])).second);
    }
    return found;
}

/// Items that the tree leads to.
inline std::size_t countInTree(const RenderScene::Impl& scene, std::uint32_t at) {
    const BoxTree::Node& node = scene.tree.node(at);
    if (!node.leaf) return countInTree(scene, node.below[0]) + countInTree(scene, node.below[1]);
    for (const std::uint32_t item : node.items()) {
        EXPECT_TRUE(scene.items[item].node);
        EXPECT_TRUE(node.box.contains(scene.boxes[item].lower) && node.box.contains(scene.boxes[item].upper));
    }
    return node.count;
}

/// The node that a light's number of a scope means; those numbers tell of the past.
inline ObjectId scopeOf(const RenderScene::Impl& scene, const LightItem& light) {
    return light.scope ? scene.scopes[light.scope - 1u] : ObjectId();
}

/// All but slots, which tell of the past.
inline void expectSame(const RenderScene& followed, const RenderScene& anew) {
    const auto a = itemsOf(followed);
    const auto b = itemsOf(anew);
    for (const auto& [node, item] : a) {
        const auto other = b.find(node);
        ASSERT_TRUE(other != b.end()) << "node " << node << " is drawn and should not be";
        ASSERT_EQ(item, other->second) << "node " << node;
    }
    for (const auto& [node, item] : b) ASSERT_TRUE(a.contains(node)) << "node " << node << " is not drawn";

    const RenderScene::Impl& x = followed.impl();
    const RenderScene::Impl& y = anew.impl();
    ASSERT_EQ(x.lights.size(), y.lights.size());
    for (std::size_t i = 0; i < x.lights.size(); ++i) {
        ASSERT_EQ(x.lights[i].kind, y.lights[i].kind) << "light " << i;
        // Bits: places beyond all numbers are the same too.
        ASSERT_EQ(std::memcmp(&x.lights[i].position, &y.lights[i].position, sizeof(Vec3d)), 0) << "light " << i;
        ASSERT_EQ(std::memcmp(&x.lights[i].direction, &y.lights[i].direction, sizeof(Vec3d)), 0) << "light " << i;
        ASSERT_EQ(x.lights[i].radiance, y.lights[i].radiance) << "light " << i;
        ASSERT_EQ(x.lights[i].range, y.lights[i].range) << "light " << i;
        ASSERT_EQ(scopeOf(x, x.lights[i]), scopeOf(y, y.lights[i])) << "light " << i;
        ASSERT_EQ(x.lights[i].outside, y.lights[i].outside) << "light " << i;
    }
    ASSERT_EQ(x.environment.sky, y.environment.sky);
    ASSERT_EQ(x.detailedItems, y.detailedItems);
    ASSERT_EQ(x.coatedItems, y.coatedItems);
    ASSERT_EQ(x.glossyItems, y.glossyItems);
    ASSERT_EQ(x.scopesLeftOut, y.scopesLeftOut);
    ASSERT_EQ(x.environment.background, y.environment.background);
    ASSERT_EQ(followed.bounds().lower, anew.bounds().lower);
    ASSERT_EQ(followed.bounds().upper, anew.bounds().upper);
    ASSERT_EQ(x.reaches.bound(), y.reaches.bound());
    std::size_t boxed = 0;
    for (const Box& box : x.boxes) boxed += box.empty() ? 0 : 1;
    ASSERT_EQ(x.tree.empty() ? 0 : countInTree(x, BoxTree::kRoot), boxed);
    ASSERT_EQ(x.rebuilds, 1u) << "it was to follow";
}

}  // namespace tessera
