// What rests in a light's view, and where that has changed: beside plain rows, and at what cost.
#include "client/render/scene/CasterPieces.h"

#include <gtest/gtest.h>

#include <map>
#include <random>

namespace tessera {
namespace {

constexpr int kMapPx = 2048;

/// Four pixels of a map in rows of 256, by the number of its node.
ShadowCaster casterOf(std::uint64_t node) {
    static const std::shared_ptr<const DrawMesh> mesh = std::make_shared<DrawMesh>();
    ShadowCaster caster;
    caster.item.node = ObjectId{node};
    caster.item.mesh = mesh;
    caster.rect = {
        .x = static_cast<int>(node % 256) * 8, .y = static_cast<int>(node / 256) * 8 % kMapPx, .width = 4, .height = 4};
    return caster;
}

std::vector<ShadowCaster> casters(std::size_t count) {
    std::vector<ShadowCaster> all;
    for (std::size_t i = 0; i < count; ++i) all.push_back(casterOf(i + 1));
    return all;
}

std::vector<std::uint64_t> nodesOf(const CasterPieces& pieces) {
    std::vector<std::uint64_t> nodes;
    pieces.each([](const PixelRect&) { return true; },
                [&](const ShadowCaster& caster) { nodes.push_back(caster.item.node.value); });
    return nodes;
}

TEST(CasterPieces, AreTheRowThatTheEditsMake) {
    std::mt19937 random(7);
    CasterPieces pieces;
    std::map<std::uint64_t, double> row;  // node: front
    for (int step = 0; step < 300; ++step) {
        SCOPED_TRACE(step);
        const CasterPieces before = pieces;
        const std::vector<std::uint64_t> nodesBefore = nodesOf(before);
        std::vector<CasterRank> gone;
        std::vector<ShadowCaster> come;
        std::map<std::uint64_t, double> now = row;
        // Now and then nearly all of them go.
        const unsigned oneIn = step % 40 == 39 ? 1 : 1 + random() % 400;
        for (const auto& [node, front] : row)
            if (random() % oneIn == 0) {
                gone.push_back(rankOf(casterOf(node)));
                now.erase(node);
            }
        for (std::size_t i = 0, count = step % 40 == 0 ? 6000 : random() % 4; i < count; ++i) {
            const std::uint64_t node = 1 + random() % 20'000;
            if (now.contains(node)) continue;
            come.push_back(casterOf(node));
            come.back().front = now[node] = step;
        }
        static_cast<void>(pieces.edit(std::move(gone), std::move(come)));
        row = std::move(now);
        std::vector<std::uint64_t> nodes;
        for (const auto& [node, front] : row) nodes.push_back(node);
        ASSERT_EQ(nodesOf(pieces), nodes);
        ASSERT_EQ(nodesOf(before), nodesBefore) << "a copy stays what it was";
        for (const auto& [node, front] : row) ASSERT_EQ(pieces.at(rankOf(casterOf(node))).front, front);
    }
}

TEST(CasterPieces, AnEditCostsWhatItEdits) {
    std::array<std::size_t, 2> copied{};
    for (std::size_t i = 0; i < 2; ++i) {
        CasterPieces pieces;
        static_cast<void>(pieces.edit({}, casters(i ? 64'000 : 4'000)));
        CasterPieces now = pieces;
        copied[i] = now.edit({rankOf(casterOf(2000))}, {});
        EXPECT_EQ(nodesOf(now).size() + 1, nodesOf(pieces).size());
    }
    EXPECT_LT(copied[0], 200u) << "a piece, a bundle, and a bundle or two that there are";
    EXPECT_LT(copied[1], copied[0] + 32);
}

TEST(CasterPieces, WhoWantsALittleIsNotAskedForAll) {
    CasterPieces pieces;
    static_cast<void>(pieces.edit({}, casters(64'000)));
    // Two rows of the map, of which one is repeated.
    const auto wanted = [](const PixelRect& rect) { return rect.y < 16 && rect.y + rect.height > 0; };
    std::size_t asked = 0, found = 0, all = 0;
    pieces.each(
        [&](const PixelRect& rect) {
            ++asked;
            return wanted(rect);
        },
        [&](const ShadowCaster&) { ++found; });
    for (const ShadowCaster& caster : casters(64'000)) all += wanted(caster.rect);
    EXPECT_EQ(found, all);
    EXPECT_GT(found, 500u);
    EXPECT_LT(asked, found + 1000) << "a few pieces at the rim, and what there is of bundles";
}

TEST(StillChanges, AreTheLastOnesAtTheCostOfThoseThatCome) {
    std::mt19937 random(5);
    StillChanges changes(1);
    std::vector<std::pair<std::uint64_t, int>> all;  // state, place
    for (std::uint64_t state = 2; state < 8000; ++state) {
        const std::size_t count = state == 1500 ? 5000 : random() % 3;
        std::vector<PixelRect> rects;
        for (std::size_t i = 0; i < count; ++i) {
            const int x = static_cast<int>(random() % kMapPx);
            rects.push_back({.x = x, .y = 0, .width = 1, .height = 1});
            all.emplace_back(state, x);
        }
        if (state == 1501) {
            EXPECT_EQ(changes.knownAfter(), 1500u) << "what comes at once, and is too much, does not stay";
        }
        if (state % 13 > 0) {
            EXPECT_LE(changes.add(state, std::move(rects)), count + 256);
            continue;
        }
        const StillChanges before = changes;
        const std::uint64_t asked = before.knownAfter() + random() % (state - before.knownAfter());
        const auto after = [asked](const StillChanges& of) {
            std::vector<int> places;
            of.after(asked, [&](const PixelRect& rect) { places.push_back(rect.x); });
            std::ranges::sort(places);
            return places;
        };
        const std::vector<int> placesBefore = after(before);
        EXPECT_LE(changes.add(state, std::move(rects)), count + 256);
        ASSERT_EQ(after(before), placesBefore) << "a copy stays what it was";
        if (asked < changes.knownAfter()) continue;
        std::vector<int> places;
        for (const auto& [of, x] : all)
            if (of > asked) places.push_back(x);
        std::ranges::sort(places);
        ASSERT_EQ(after(changes), places) << "after " << asked << ", in " << state;
    }
    EXPECT_GT(changes.knownAfter(), 2000u);
    EXPECT_LT(changes.knownAfter(), 6500u);
}

}  // namespace
}  // namespace tessera
