// Lights with scopes: each thing is as bright as with the lights that reach it alone.
#include <algorithm>
#include <cstdlib>
#include <map>
#include <random>

#include "tests/unit/draw/RendererStage.h"

namespace tessera {
namespace {

/// A lamp of a room, and which of its groups it lights; -1: all.
struct ScopedLamp {
    enum class Kind { kSun, kPoint, kSpot } kind = Kind::kPoint;
    Vec3d place = Vec3d::Zero(), way = -Vec3d::UnitZ();
    Vec3f color = Vec3f::Ones();
    float range = 0;
    bool shadows = false;
    int group = -1;
    bool outside = false;
};

/// Two groups below each other and one beside them, each with a ball and a box, one with a sheet of glass.
class ScopeTest : public RendererTest {
protected:
    static constexpr int kGroups = 3;
    /// Whether a lamp lights what is in a group: 1 lies in 0.
    static bool reaches(const ScopedLamp& lamp, int group) {
        if (lamp.group < 0) return true;
        const bool within = lamp.group == group || (lamp.group == 0 && group == 1);
        return within != lamp.outside;
    }
    struct Room {
        Aspect aspect;
        std::map<std::uint64_t, int> groupOf;  ///< by node
    };
    static Room room(const std::vector<ScopedLamp>& lamps, bool mapped, int glassIn) {
        TestScene scene;
        scene.setEnvironment(Vec3f::Constant(0.05f), Vec3f::Constant(0.02f), Vec3f(0.1f, 0.1f, 0.2f));
        Material matt, gloss, glass;
        matt.baseColor = Vec4f(0.8f, 0.7f, 0.6f, 1);
        gloss.roughness = 0.3f;
        gloss.metallic = 0.6f;
        gloss.clearcoat = 0.5f;
        glass.baseColor = Vec4f(0.4f, 0.6f, 0.7f, 0.4f);
        if (mapped) {
            const std::array<std::uint8_t, 8> two{200, 90, 10, 255, 60, 200, 250, 255};
            gloss.occlusionImage = scene.addImage(Blob::of(std::span<const std::uint8_t>(two)), 2, 1);
            matt.baseColorImage = gloss.occlusionImage;
        }
        const ObjectId paints[] = {scene.add(matt), scene.add(gloss), scene.add(glass)};
        const ObjectId shapes[] = {scene.add(makeSphere(0.35, 20), paints[0]),
                                   scene.add(makeBox({0.5, 0.5, 0.5}), paints[1]),
                                   scene.add(makeSheet(0.5, 0.9), paints[2])};
        Room room;
        std::array<ObjectId, kGroups> groups;
        for (int g = 0; g < kGroups; ++g) {
            groups[static_cast<std::size_t>(g)] =
                scene.addTransform({g == 1 ? 0.0 : 1.0 * g - 1, g == 1 ? 1.0 : -0.5, -1}, Quatd::Identity(),
                                   Vec3d::Ones(), g == 1 ? groups[0] : kRootNode);
            for (int i = 0; i < (g == glassIn ? 3 : 2); ++i) {
                const ObjectId at =
                    scene.addTransform({0.45 * i - 0.4, 0.05 * i, 0.5 * i}, Quatd(0.9, 0.1, 0.2, 0.1 * i).normalized(),
                                       Vec3d::Ones(), groups[static_cast<std::size_t>(g)]);
                room.groupOf[scene.addNode(shapes[i], at).value] = g;
            }
        }
        for (const ScopedLamp& lamp : lamps) {
            const ObjectId scope = lamp.group < 0 ? ObjectId() : groups[static_cast<std::size_t>(lamp.group)];
            const ObjectId at = scene.addTransform(lamp.place, Quatd::FromTwoVectors(-Vec3d::UnitZ(), lamp.way));
            if (lamp.kind == ScopedLamp::Kind::kSun)
                scene.addNode(
                    scene.addCore(DirectionalLight{
                        .color = lamp.color, .shadows = lamp.shadows, .scope = scope, .outside = lamp.outside}),
                    at);
            else if (lamp.kind == ScopedLamp::Kind::kPoint)
                scene.addNode(scene.addCore(PointLight{.color = lamp.color,
                                                       .intensity = 2,
                                                       .range = lamp.range,
                                                       .scope = scope,
                                                       .outside = lamp.outside}),
                              at);
            else
                scene.addNode(scene.addCore(SpotLight{.color = lamp.color,
                                                      .intensity = 4,
                                                      .range = lamp.range,
                                                      .outerAngle = 0.8f,
                                                      .shadows = lamp.shadows,
                                                      .scope = scope,
                                                      .outside = lamp.outside}),
                              at);
        }
        room.aspect = scene.take();
        return room;
    }
    Picture drawn(const Room& room) { return draw(room.aspect, camera_); }
    std::vector<std::uint64_t> idsOf(const Room& room) {
        auto ids = renderer_->drawNodeIds(room.aspect, listOf(room.aspect, camera_), camera_, whole(camera_));
        EXPECT_TRUE(ids);
        return ids ? *ids : std::vector<std::uint64_t>();
    }
    const ScreenCamera camera_ = cameraOf(320, 200);
};

std::vector<ScopedLamp> randomLamps(std::mt19937& random) {
    const auto between = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    std::vector<ScopedLamp> lamps(1 + random() % 6);
    for (ScopedLamp& lamp : lamps) {
        lamp.kind = static_cast<ScopedLamp::Kind>(random() % 3);
        lamp.place = {between(-2, 2), between(-1, 2), between(0, 1.5)};
        lamp.way = Vec3d(between(-1, 1), between(-1, 0.3), between(-1.5, -0.3)) - 0.3 * lamp.place;
        lamp.color = Vec3f(static_cast<float>(between(0.2, 0.8)), static_cast<float>(between(0.2, 0.8)),
                           static_cast<float>(between(0.2, 0.8)));
        lamp.range = random() % 2 ? static_cast<float>(between(1, 4)) : 0;
        lamp.shadows = random() % 3 == 0;
        lamp.group = static_cast<int>(random() % 4) - 1;
        lamp.outside = random() % 2;
    }
    return lamps;
}

// A pixel of a thing beside that pixel with the lamps that reach the thing, without scopes.
TEST_F(ScopeTest, EachThingIsAsBrightAsWithTheLightsThatReachIt) {
    const char* said = std::getenv("TESSERA_SEED");
    const unsigned first = said ? static_cast<unsigned>(std::atoi(said)) : 1;
    int compared = 0, throughGlass = 0, differently = 0;
    for (unsigned seed = first; seed < (said ? first + 1 : 9); ++seed) {
        SCOPED_TRACE(testing::Message() << "TESSERA_SEED=" << seed << " unit_draw --gtest_filter=ScopeTest.EachThing*");
        std::mt19937 random(seed);
        const std::vector<ScopedLamp> lamps = randomLamps(random);
        const bool mapped = seed % 3 == 0;
        const int glassIn = static_cast<int>(seed % 4) - 1;
        const Room scoped = room(lamps, mapped, glassIn);
        const Picture picture = drawn(scoped);
        // Through glass a pixel shows two things.
        const Room solid = room(lamps, mapped, -1);
        const std::vector<std::uint64_t> ids = idsOf(scoped), behind = idsOf(solid);
        const auto isOf = [](const Room& all, std::uint64_t id, int group) {
            const auto found = all.groupOf.find(id);
            return found != all.groupOf.end() && found->second == group;
        };
        for (int group = 0; group < kGroups; ++group) {
            std::vector<ScopedLamp> reaching;
            for (ScopedLamp lamp : lamps) {
                if (!reaches(lamp, group))
                    lamp.color = Vec3f::Zero();  // it keeps its place among those that get shadows
                lamp.group = -1;
                reaching.push_back(lamp);
            }
            const Room plain = room(reaching, mapped, glassIn);
            const Picture should = drawn(plain);
            for (std::size_t i = 0; i < ids.size(); ++i) {
                const bool sky = !solid.groupOf.contains(behind[i]);
                if (!isOf(scoped, ids[i], group) || (!sky && !isOf(solid, behind[i], group))) continue;
                ++compared;
                throughGlass += sky || ids[i] != behind[i];
                for (std::size_t c = 0; c < 3; ++c)
                    ASSERT_NEAR(picture.rgb[3 * i + c], should.rgb[3 * i + c], 1)
                        << "pixel " << i << ", group " << group;
            }
        }
        std::vector<ScopedLamp> everywhere = lamps;
        for (ScopedLamp& lamp : everywhere) lamp.group = -1;
        const Picture unlike = drawn(room(everywhere, mapped, glassIn));
        for (std::size_t i = 0; i < picture.rgb.size(); ++i)
            differently += std::abs(picture.rgb[i] - unlike.rgb[i]) > 8;
    }
    if (said) return;
    EXPECT_GT(throughGlass, 1000);
    EXPECT_GT(compared, 40000);
    EXPECT_GT(differently, 60000) << "without scopes it looks the same";
}

// What lists of lights leave away, and where a tile ends, changes no byte.
TEST_F(ScopeTest, ListsAndTilesChangeNoByte) {
    const char* said = std::getenv("TESSERA_SEED");
    const unsigned first = said ? static_cast<unsigned>(std::atoi(said)) : 1;
    const auto part = [&](const Aspect& aspect, const PixelRect& rect, RendererOptions options) {
        restart(options);
        auto picture = renderer_->draw(aspect, listOf(aspect, camera_), camera_, rect);
        EXPECT_TRUE(picture);
        return picture ? picture->rgb : std::vector<std::uint8_t>();
    };
    for (unsigned seed = first; seed < (said ? first + 1 : 7); ++seed) {
        SCOPED_TRACE(testing::Message() << "TESSERA_SEED=" << seed << " unit_draw --gtest_filter=ScopeTest.Lists*");
        std::mt19937 random(seed);
        std::vector<ScopedLamp> lamps = randomLamps(random);
        lamps.push_back({.place = {0, 0.4, 0.2}, .range = 2, .group = 0});
        const Room of = room(lamps, seed % 2 == 0, 1);
        const int samples = seed % 2 ? 4 : 1;
        const PixelRect all = whole(camera_), rect{.x = 77, .y = 41, .width = 150, .height = 101};
        const auto picture = part(of.aspect, all, {.samples = samples});
        EXPECT_TRUE(picture == part(of.aspect, all, {.samples = samples, .clusterLights = false}));
        const auto tile = part(of.aspect, rect, {.samples = samples});
        int differing = 0;
        for (int y = 0; y < rect.height; ++y)
            for (int x = 0; x < 3 * rect.width; ++x) {
                const int row = all.height - rect.y - rect.height + y;
                differing += picture[static_cast<std::size_t>(3 * (row * all.width + rect.x) + x)] !=
                             tile[static_cast<std::size_t>(3 * y * rect.width + x)];
            }
        EXPECT_EQ(differing, 0);
    }
}

}  // namespace
}  // namespace tessera
