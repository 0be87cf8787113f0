/// Particles: each pixel beside its formula; the order, the head, ages and boxes of many.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>

#include "client/draw/store/DrawForms.h"
#include "common/cores/Particles.h"
#include "common/drawable/Drawable.h"
#include "tests/unit/draw/RendererStage.h"

namespace tessera {
namespace {

template <typename Number>
Blob blobFrom(const std::vector<Number>& numbers) {
    return numbers.empty() ? Blob() : Blob::of(std::span<const Number>(numbers));
}

constexpr ObjectId kParticlesId{5000}, kMaterialId{5001};

/// In the dark, unlit anyway: particles below a transform.
Aspect aspectWith(const Particles& particles, const Vec3d& scale = Vec3d::Ones()) {
    TestScene scene;
    scene.setDark();
    const ObjectId parent = scene.addTransform(Vec3d::Zero(), Quatd::Identity(), scale);
    Aspect aspect = scene.take();
    ChangeListBuilder edit;
    edit.create(kParticlesId, typeOf<Particles>());
    setAllFields(edit, kParticlesId, Object::of(particles));
    Material white;  // without one they have everybody's grey
    white.baseColor = Vec4f::Ones();
    edit.create(kMaterialId, typeOf<Material>());
    setAllFields(edit, kMaterialId, Object::of(white));
    edit.set(kParticlesId, typeOf<Particles>(), fieldId<&Particles::material>, toValue(kMaterialId));
    const ObjectId node{5002};
    edit.create(node, typeOf<Node>());
    edit.set(node, typeOf<Node>(), fieldId<&Node::core>, toValue(kParticlesId));
    edit.place(node, parent);
    const Expected<void> applied = aspect.apply(edit.take());
    EXPECT_TRUE(applied) << applied.error().message;
    return aspect;
}

struct Layer {
    double depth = 0;
    std::array<double, 3> color{};  ///< encoded, of 255
    double alpha = 0;
};

/// Back to front, in the encoded picture, rounded to bytes each time.
Rgb composed(std::vector<Layer> layers) {
    std::sort(layers.begin(), layers.end(), [](const Layer& a, const Layer& b) { return a.depth > b.depth; });
    std::array<double, 3> out{};
    for (const Layer& layer : layers)
        for (std::size_t c = 0; c < 3; ++c)
            out[c] = std::round(layer.color[c] * layer.alpha + out[c] * (1 - layer.alpha));
    return {static_cast<int>(out[0]), static_cast<int>(out[1]), static_cast<int>(out[2])};
}

class ParticleTest : public RendererTest {
protected:
    struct Cloud {
        Particles core;
        std::vector<float> places, tails, sizes, turns;
        std::vector<std::uint8_t> colors;
    };
    static Cloud someCloud(std::mt19937& random, std::int64_t mode, std::size_t count) {
        const auto any = [&](double from, double to) {
            return static_cast<float>(std::uniform_real_distribution<double>(from, to)(random));
        };
        Cloud cloud;
        cloud.core.mode = mode;
        for (std::size_t i = 0; i < count; ++i) {
            for (const float range : {1.0F, 1.0F, 1.5F}) {
                cloud.places.push_back(any(-1, 1) * range);
                cloud.tails.push_back(any(-1, 1) * range);
            }
            cloud.sizes.push_back(mode == Particles::kLines ? any(1, 12) : any(0.1, 0.9));
            cloud.turns.push_back(any(-7, 7));
            for (int c = 0; c < 4; ++c) cloud.colors.push_back(static_cast<std::uint8_t>(random() % 256));
        }
        cloud.core.positions = blobFrom(cloud.places);
        cloud.core.tails = blobFrom(cloud.tails);
        cloud.core.sizes = blobFrom(cloud.sizes);
        cloud.core.turns = blobFrom(cloud.turns);
        cloud.core.colors = blobFrom(cloud.colors);
        return cloud;
    }
    static Vec3d placeOf(const std::vector<float>& places, std::size_t i) {
        return {places[3 * i], places[3 * i + 1], places[3 * i + 2]};
    }

    /// `inside(i, ray)`: how far within particle i the pixel's ray passes, in pixels, negative outside. Pixels near a
    /// rim are left out.
    template <typename Inside>
    void expectPicture(const Picture& picture, const Cloud& cloud, const ScreenCamera& camera, const Vec3d& scale,
                       Inside&& inside) {
        int looked = 0, covered = 0;
        for (int y = 0; y < kSidePx; ++y)
            for (int x = 0; x < kSidePx; ++x) {
                const Vec2d at(x + 0.5, kSidePx - y - 0.5);
                std::vector<Layer> layers;
                bool near = false;
                for (std::size_t i = 0; i < cloud.sizes.size() && !near; ++i) {
                    const double within = inside(i, at);
                    near = std::abs(within) < 0.8;
                    if (near || within < 0) continue;
                    Vec3d middle = placeOf(cloud.places, i);
                    if (cloud.core.mode == Particles::kLines) middle = 0.5 * (middle + placeOf(cloud.tails, i));
                    Layer layer{.depth = -(camera.eye_T_world * scale.cwiseProduct(middle)).z(),
                                .alpha = cloud.colors[4 * i + 3] / 255.0};
                    for (std::size_t c = 0; c < 3; ++c) layer.color[c] = cloud.colors[4 * i + c];
                    layers.push_back(layer);
                }
                if (near) continue;
                ++looked;
                covered += !layers.empty();
                const Rgb wanted = composed(layers), is = pixel(picture, x, y);
                // Each layer is rounded once.
                const double tolerance = 1 + 0.5 * static_cast<double>(layers.size());
                ASSERT_TRUE(std::abs(is.r - wanted.r) <= tolerance && std::abs(is.g - wanted.g) <= tolerance &&
                            std::abs(is.b - wanted.b) <= tolerance)
                    << x << ' ' << y << ": " << is << ", wanted " << wanted << " of " << layers.size() << " layers";
            }
        EXPECT_GT(looked, 300);
        EXPECT_GT(covered, 150);
    }

    /// Of a place in eye space, from below.
    static Vec2d pixelOf(const ScreenCamera& camera, const Vec3d& eye) {
        const Vec4d clip = camera.clip_T_eye * eye.homogeneous();
        return 0.5 * kSidePx * (clip.head<2>() / clip.w() + Vec2d::Ones());
    }
};

TEST_F(ParticleTest, PointsAreRoundAndLieInEachOtherAsTheyShould) {
    for (unsigned seed = 1; seed <= 6; ++seed) {
        std::mt19937 random(seed);
        const Cloud cloud = someCloud(random, Particles::kPoints, 9);
        const Vec3d scale = seed % 2 == 0 ? Vec3d(1, 1, 1) : Vec3d(0.7, 0.7, 0.7);
        const ScreenCamera camera = cameraOf(kSidePx, kSidePx, {0.2, 0.1, 2.4});
        const Picture picture = draw(aspectWith(cloud.core, scale), camera);
        expectPicture(picture, cloud, camera, scale, [&](std::size_t i, const Vec2d& at) {
            const Vec3d middle = camera.eye_T_world * scale.cwiseProduct(placeOf(cloud.places, i));
            const double radius = 0.5 * static_cast<double>(cloud.sizes[i]) * scale.x();
            const Vec2d on = pixelOf(camera, middle), beside = pixelOf(camera, middle + Vec3d(radius, 0, 0));
            return (beside - on).norm() - (at - on).norm();
        });
    }
}

TEST_F(ParticleTest, QuadsFaceTheHeadWhateverTheEye) {
    for (unsigned seed = 1; seed <= 6; ++seed) {
        std::mt19937 random(seed);
        const Cloud cloud = someCloud(random, Particles::kQuads, 9);
        ScreenCamera camera = cameraOf(kSidePx, kSidePx, {0.2, 0.1, 2.4});
        camera.headWorld = Vec3d(-0.8, 0.6, 2.1);
        const Picture picture = draw(aspectWith(cloud.core), camera);
        expectPicture(picture, cloud, camera, Vec3d::Ones(), [&](std::size_t i, const Vec2d& at) {
            const Vec3d middle = placeOf(cloud.places, i), towards = (camera.headWorld - middle).normalized();
            const Vec3d aside = Vec3d::UnitY().cross(towards).normalized(), up = towards.cross(aside);
            const double turn = cloud.turns[i], half = 0.5 * static_cast<double>(cloud.sizes[i]);
            // From the corners' lines on the screen, counter-clockwise.
            double within = 1e9;
            std::array<Vec2d, 4> corners;
            for (std::size_t k = 0; k < 4; ++k) {
                const double x = k == 1 || k == 2 ? 1 : -1, y = k >= 2 ? 1 : -1;
                const Vec3d place = middle + half * ((std::cos(turn) * x - std::sin(turn) * y) * aside +
                                                     (std::sin(turn) * x + std::cos(turn) * y) * up);
                corners[k] = pixelOf(camera, camera.eye_T_world * place);
            }
            for (std::size_t k = 0; k < 4; ++k) {
                const Vec2d along = (corners[(k + 1) % 4] - corners[k]).normalized(), from = at - corners[k];
                within = std::min(within, along.x() * from.y() - along.y() * from.x());
            }
            return within;
        });
    }
}

TEST_F(ParticleTest, LinesAreEachAsWideAsTheySay) {
    for (unsigned seed = 1; seed <= 6; ++seed) {
        std::mt19937 random(seed);
        const Cloud cloud = someCloud(random, Particles::kLines, 9);
        const ScreenCamera camera = cameraOf(kSidePx, kSidePx);
        const Picture picture = draw(aspectWith(cloud.core), camera);
        expectPicture(picture, cloud, camera, Vec3d::Ones(), [&](std::size_t i, const Vec2d& at) {
            const Vec2d from = pixelOf(camera, camera.eye_T_world * placeOf(cloud.tails, i)),
                        to = pixelOf(camera, camera.eye_T_world * placeOf(cloud.places, i));
            const double size = (to - from).norm(), half = 0.5 * static_cast<double>(cloud.sizes[i]);
            const Vec2d along = (to - from) / size, off = at - from;
            const double beside = std::abs(along.x() * off.y() - along.y() * off.x()),
                         beyond = std::max(-off.dot(along), off.dot(along) - size);
            return half - std::max(beside, beyond);
        });
    }
}

TEST_F(ParticleTest, AreDrawnAsTheArraysHaveThemWhereTheyAreNotSorted) {
    Particles two;
    two.positions = blobFrom<float>({0, 0, 0.5F, 0, 0, -0.5F});  // the near one first
    two.colors = blobFrom<std::uint8_t>({255, 0, 0, 255, 0, 255, 0, 255});
    two.size = 1;
    EXPECT_GT(center(draw(aspectWith(two), cameraOf(kSidePx, kSidePx))).r, 250);
    two.sorted = false;
    EXPECT_GT(center(draw(aspectWith(two), cameraOf(kSidePx, kSidePx))).g, 250);
}

TEST_F(ParticleTest, AreNotThereBeforeTheirBirthAndAfterTheirEnd) {
    for (const auto& [age, size] : {std::pair(-0.01F, 0.0F), {0.0F, 0.2F}, {0.5F, 0.6F}, {1.0F, 1.0F}, {1.01F, 0.0F}}) {
        Particles one;
        one.positions = blobFrom<float>({0, 0, 0});
        one.ages = blobFrom<float>({age});
        one.ageSizes = blobFrom<float>({0.2F, 1.0F});
        one.ageColors = blobFrom<std::uint8_t>({255, 255, 255, 255, 255, 255, 255, 255});
        one.size = 1;
        const Picture picture = draw(aspectWith(one), cameraOf(kSidePx, kSidePx));
        int bright = 0;
        for (int x = 0; x < kSidePx; ++x) bright += pixel(picture, x, kSidePx / 2).r > 127;
        EXPECT_NEAR(bright, static_cast<double>(size) / 3.2 * kSidePx, 1.5) << age;
    }
}

TEST_F(ParticleTest, TakeColourAndPictureOfTheirMaterial) {
    const std::array<std::uint8_t, 16> pixels{255, 0, 0,   255, 0,   255, 0,   255,
                                              0,   0, 255, 255, 255, 255, 255, 255};  // from the top
    TestScene scene;
    scene.setDark();
    const ObjectId image = scene.add(Image{.pixels = Blob::of(std::span<const std::uint8_t>(pixels)),
                                           .widthPx = 2,
                                           .heightPx = 2,
                                           .magnification = Image::kNearest});
    Aspect aspect = scene.take();
    Particles one;
    one.mode = Particles::kQuads;
    one.positions = blobFrom<float>({0, 0, 0});
    one.size = 2;
    Material material;
    material.baseColor = Vec4f::Ones();
    material.baseColorImage = image;
    ChangeListBuilder edit;
    edit.create(kMaterialId, typeOf<Material>());
    setAllFields(edit, kMaterialId, Object::of(material));
    one.material = kMaterialId;
    edit.create(kParticlesId, typeOf<Particles>());
    setAllFields(edit, kParticlesId, Object::of(one));
    edit.create(ObjectId{5002}, typeOf<Node>());
    edit.set(ObjectId{5002}, typeOf<Node>(), fieldId<&Node::core>, toValue(kParticlesId));
    edit.place(ObjectId{5002}, kRootNode);
    ASSERT_TRUE(aspect.apply(edit.take()));
    const Picture picture = draw(aspect, cameraOf(kSidePx, kSidePx));
    const int near = kSidePx / 2 - 6, far = kSidePx / 2 + 6;
    expectNear(pixel(picture, near, near), {255, 0, 0});
    expectNear(pixel(picture, far, near), {0, 255, 0});
    expectNear(pixel(picture, near, far), {0, 0, 255});
    expectNear(pixel(picture, far, far), {255, 255, 255});
}

// Sizes and widths stand out of the places' box: nothing of them may go with it.
TEST_F(ParticleTest, LoseNothingToACuller) {
    restart({.samples = 4});
    for (unsigned seed = 1; seed <= 24; ++seed) {
        std::mt19937 random(seed);
        const auto any = [&](double from, double to) {
            return std::uniform_real_distribution<double>(from, to)(random);
        };
        Cloud cloud = someCloud(random, static_cast<std::int64_t>(seed % 3), 2);
        const Vec3d scale(any(0.2, 2), any(0.2, 2), any(0.2, 2));
        ScreenCamera camera = cameraOf(kSidePx, kSidePx, {any(-3, 3), any(-3, 3), 2.4});
        camera.headWorld = Vec3d(any(-1, 1), any(-1, 1), any(-1, 3));
        const Aspect aspect = aspectWith(cloud.core, scale);
        RenderScene scene;
        scene.update(aspect, nullptr);
        for (int i = 0; i < 4; ++i) {
            const PixelRect part{.x = 32 * (i % 2), .y = 32 * (i / 2), .width = 32, .height = 32};
            RenderAction all(CullerKind::kNone), culled(CullerKind::kFrustum);
            const auto wanted = renderer_->draw(aspect, all.run(scene, camera, part, nullptr), camera, part);
            const auto is = renderer_->draw(aspect, culled.run(scene, camera, part, nullptr), camera, part);
            ASSERT_TRUE(wanted && is);
            ASSERT_EQ(*wanted, *is) << "seed " << seed;
        }
    }
}

// Who writes places in ranges pays for what was written; the picture is that of who never saw anything else.
TEST_F(ParticleTest, UploadTheRangesThatAreWritten) {
    for (std::int64_t mode = 0; mode < 3; ++mode) {
        std::mt19937 random(7);
        const Cloud cloud = someCloud(random, mode, 2000);
        Aspect aspect = aspectWith(cloud.core);
        const ScreenCamera camera = cameraOf(kSidePx, kSidePx);
        RenderScene scene;
        scene.update(aspect, nullptr);
        RenderAction action(CullerKind::kNone);
        ASSERT_TRUE(renderer_->draw(aspect, action.run(scene, camera, whole(camera), nullptr), camera, whole(camera)));
        for (int turn = 0; turn < 5; ++turn) {
            const std::size_t first = random() % 1900, count = 1 + random() % 100;
            const std::vector<float> moved(3 * count, 0.1F * static_cast<float>(turn));
            ChangeListBuilder edit;
            edit.setRange(kParticlesId, typeOf<Particles>(), fieldId<&Particles::positions>, 12 * first,
                          Blob::of(std::span<const float>(moved)));
            const ChangeList list = edit.take();
            ASSERT_TRUE(aspect.apply(list));
            scene.update(aspect, &list);
            const std::uint64_t before = renderer_->uploadedMeshBytes();
            const auto picture =
                renderer_->draw(aspect, action.run(scene, camera, whole(camera), nullptr), camera, whole(camera));
            ASSERT_TRUE(picture);
            EXPECT_EQ(renderer_->uploadedMeshBytes() - before, count * 4 * sizeof(MeshVertex)) << mode;
            const auto another = test::pooledSurface();
            auto fresh = Renderer::create(*another, {.samples = 1});
            ASSERT_TRUE(fresh);
            const auto wanted = (*fresh)->draw(aspect, listOf(aspect, camera), camera, whole(camera));
            ASSERT_TRUE(wanted);
            ASSERT_EQ(*picture, *wanted) << mode;
        }
    }
}

}  // namespace
}  // namespace tessera
