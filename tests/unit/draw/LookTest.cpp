// Looks that stay in GL: what a change makes old is made anew, and nothing else is.
#include <algorithm>
#include <random>

#include "client/render/scene/ShadowCasters.h"
#include "common/change/ChangeList.h"
#include "tests/unit/draw/RendererStage.h"

namespace tessera {
namespace {

class LookTest : public RendererTest {
protected:
    /// A scene that is followed, and a list of it as a host has one.
    void follow(Aspect aspect) {
        aspect_ = std::move(aspect);
        scene_.update(aspect_, nullptr);
    }
    template <typename T>
    void set(ObjectId id, FieldId field, const auto& value) {
        builder_.set(id, typeOf<T>(), field, toValue(value));
    }
    void apply() {
        const ChangeList list = builder_.take();
        ASSERT_TRUE(aspect_.apply(list));
        scene_.update(aspect_, &list);
    }
    Picture followed(const ScreenCamera& camera) {
        auto picture =
            renderer_->draw(aspect_, action_.run(scene_, camera, whole(camera), nullptr), camera, whole(camera));
        EXPECT_TRUE(picture) << picture.error().message;
        return picture ? *picture : Picture();
    }

    Aspect aspect_;
    RenderScene scene_;
    RenderAction action_{CullerKind::kNone};
    ChangeListBuilder builder_;
};

// What 10,000 things look like goes to GL once, and not again while nothing but the eye changes.
TEST_F(LookTest, AMaterialOfTenThousandUsersIsOneUpload) {
    TestScene built;
    built.setDark();
    const ObjectId material = built.add(unlit({0.5f, 0.2f, 0.1f}));
    const ObjectId sheet = built.add(makeSheet(0.02, 0.02), material);
    for (int i = 0; i < 10'000; ++i) built.place(sheet, {0.02 * (i % 100) - 1, 0.02 * (i / 100) - 1, -0.001 * (i % 7)});
    follow(built.take());
    const ScreenCamera camera = cameraOf(kSidePx, kSidePx), aside = cameraOf(kSidePx, kSidePx, {0.1, 0, 2.4});
    (void)followed(camera);
    EXPECT_EQ(renderer_->lastCounts().looksUploaded, 1u);
    (void)followed(aside);
    EXPECT_EQ(renderer_->lastCounts().looksUploaded, 0u) << "the eye alone has moved";
    set<Material>(material, fieldId<&Material::emissive>, Vec3f(0.1f, 0.2f, 0.6f));
    apply();
    const Picture changed = followed(camera);
    EXPECT_EQ(renderer_->lastCounts().items, 10'000u);
    EXPECT_EQ(renderer_->lastCounts().looksUploaded, 1u);
    expectNear(center(changed), expectedOf({0.1f, 0.2f, 0.6f}));
}

/// Things whose materials are made of all that materials are made of.
struct Dressed {
    TestScene built;
    std::vector<ObjectId> images, layers, uniforms, programs, materials, geometries;
    std::mt19937 random{11};

    float any() { return std::uniform_real_distribution<float>(0.1f, 1)(random); }
    template <typename T>
    ObjectId one(const std::vector<T>& of) {
        return of[random() % of.size()];
    }
    Blob pixels() {
        std::vector<std::uint8_t> bytes;
        for (int i = 0; i < 4 * 4 * 4; ++i)
            bytes.push_back(static_cast<std::uint8_t>(i % 4 == 3 && random() % 3 ? 255 : random()));
        return Blob::of(std::span<const std::uint8_t>(bytes));
    }
    Aspect make() {
        built.setEnvironment(Vec3f::Constant(0.3f), Vec3f::Constant(0.1f), Vec3f(0.1f, 0.2f, 0.3f));
        built.addDirectionalLight(Vec3d(-0.3, -0.5, -1), Vec3f::Ones(), 2, true);
        for (int i = 0; i < 4; ++i) images.push_back(built.addImage(pixels(), 4, 4));
        for (int i = 0; i < 3; ++i)
            layers.push_back(built.addCore(TextureLayer{.image = one(images), .mode = i, .strength = any()}));
        uniforms.push_back(built.add(Uniform{.name = "tint", .value = Vec4f::Constant(any()), .image = {}}));
        SurfaceProgram program;
        program.surface = "uniform vec3 tint;\nvoid surface(inout Surface s) { s.base.rgb *= tint; }";
        program.verdict = SurfaceProgram::kGood;
        programs.push_back(built.add(program));
        for (int i = 0; i < 8; ++i) {
            Material material;
            material.baseColor = Vec4f(any(), any(), any(), 1);
            material.roughness = any();
            material.alphaMode = i % 4 == 1 ? Material::kMask : i % 4 == 2 ? Material::kBlend : Material::kOpaque;
            if (i % 2) material.baseColorImage = one(images);
            if (i % 3 == 1) material.normalImage = one(images);
            if (i == 3) material.layers = {layers[0], layers[1]};
            if (i == 5) {
                material.program = programs[0];
                material.uniforms = {uniforms[0]};
            }
            if (i == 6) material.passes = {materials[0], materials[5]};
            if (i == 7) {
                material.coarser = materials[2];
                material.coarserBelow = 20;
            }
            materials.push_back(built.add(material));
        }
        for (std::size_t i = 0; i < 24; ++i) {
            geometries.push_back(built.add(i % 3 ? makeSheet(0.4, 0.3) : makeSphere(0.2, 12), materials[i % 8]));
            built.place(geometries.back(),
                        {0.4 * static_cast<double>(i % 6) - 1, 0.5 * static_cast<double>(i / 6) - 0.8,
                         -0.05 * static_cast<double>(i % 5)});
        }
        return built.take();
    }
};

// Changes of any of it, one after the other and several at once: each picture is that of who knows nothing of what was.
TEST_F(LookTest, AfterAnyChangeItIsThatOfANewScene) {
    for (const std::size_t budget : {std::size_t{1} << 30, std::size_t{100}}) {
        restart({.samples = 1, .textureBudgetBytes = budget});
        Dressed dressed;
        follow(dressed.make());
        const ScreenCamera camera = cameraOf(kSidePx, kSidePx);
        auto surface = makeSurface("osmesa");
        ASSERT_TRUE(surface);
        auto other = Renderer::create(**surface, {.samples = 1});
        ASSERT_TRUE(other);
        std::mt19937& random = dressed.random;
        const auto material = [&] { return dressed.one(dressed.materials); };
        const std::vector<std::function<void()>> edits = {
            [&] { set<Material>(material(), fieldId<&Material::baseColor>, Vec4f(dressed.any(), 0.4f, 0.2f, 1)); },
            [&] { set<Material>(material(), fieldId<&Material::roughness>, dressed.any()); },
            [&] { set<Material>(material(), fieldId<&Material::doubleSided>, random() % 2 == 0); },
            [&] { set<Material>(material(), fieldId<&Material::alphaMode>, static_cast<std::int64_t>(random() % 4)); },
            [&] { set<Material>(material(), fieldId<&Material::baseColorImage>, dressed.one(dressed.images)); },
            [&] { set<Material>(material(), fieldId<&Material::normalImage>, dressed.one(dressed.images)); },
            [&] { set<Material>(material(), fieldId<&Material::emissiveImage>, dressed.one(dressed.images)); },
            [&] { set<Material>(material(), fieldId<&Material::layers>, RefList{dressed.one(dressed.layers)}); },
            [&] {
                set<Material>(material(), fieldId<&Material::passes>, RefList{material(), material()});
            },
            [&] { set<Material>(material(), fieldId<&Material::coarser>, material()); },
            [&] { set<Material>(material(), fieldId<&Material::coarserBelow>, 30.0 * dressed.any()); },
            [&] { set<Material>(material(), fieldId<&Material::program>, dressed.programs[0]); },
            [&] { set<Material>(material(), fieldId<&Material::uniforms>, RefList{dressed.uniforms[0]}); },
            [&] { set<Material>(material(), fieldId<&Material::fill>, static_cast<std::int64_t>(random() % 3)); },
            [&] { set<Image>(dressed.one(dressed.images), fieldId<&Image::pixels>, dressed.pixels()); },
            [&] { set<Image>(dressed.one(dressed.images), fieldId<&Image::rotation>, dressed.any()); },
            [&] {
                set<Image>(dressed.one(dressed.images), fieldId<&Image::wrapU>,
                           static_cast<std::int64_t>(random() % 3));
            },
            [&] { set<TextureLayer>(dressed.one(dressed.layers), fieldId<&TextureLayer::strength>, dressed.any()); },
            [&] {
                set<TextureLayer>(dressed.one(dressed.layers), fieldId<&TextureLayer::image>,
                                  dressed.one(dressed.images));
            },
            [&] { set<Uniform>(dressed.uniforms[0], fieldId<&Uniform::value>, Vec4f(dressed.any(), 0.5f, 1, 1)); },
            [&] {
                set<SurfaceProgram>(dressed.programs[0], fieldId<&SurfaceProgram::verdict>,
                                    static_cast<std::int64_t>(1 + random() % 3));
            },
            [&] { set<Geometry>(dressed.one(dressed.geometries), fieldId<&Geometry::material>, material()); },
        };
        std::size_t different = 0;
        Picture before;
        for (int round = 0; round < 40; ++round) {
            for (unsigned k = 0, count = 1 + random() % 3; k < count; ++k) edits[random() % edits.size()]();
            ASSERT_NO_FATAL_FAILURE(apply());
            const Picture picture = followed(camera);
            const auto anew = (*other)->draw(aspect_, listOf(aspect_, camera), camera, whole(camera));
            ASSERT_TRUE(anew);
            ASSERT_EQ(picture, *anew) << "round " << round << ", images in " << budget << " bytes";
            different += picture != before;
            before = picture;
        }
        EXPECT_GT(different, 20u) << "changes that show nothing prove nothing";
    }
}

// What a list names is there as long as the list is, whatever has come in its place: parts are drawn for neighbours,
// and lists are kept to be compared.
TEST_F(LookTest, AListOutlivesTheUpdateThatReplacesItsMeshes) {
    TestScene built;
    built.setDark();
    const ObjectId sheet = built.add(makeSheet(1, 1), built.add(unlit({0.2f, 0.5f, 0.1f})));
    built.place(sheet, Vec3d::Zero());
    follow(built.take());
    const ScreenCamera camera = cameraOf(kSidePx, kSidePx);
    const DrawList list = action_.run(scene_, camera, whole(camera), nullptr);
    const Picture before = followed(camera);
    set<Geometry>(sheet, fieldId<&Geometry::positions>, makeSheet(2, 0.2).toArrays().positions);
    apply();
    restart({.samples = 1});
    const auto old = renderer_->draw(aspect_, list, camera, whole(camera));
    ASSERT_TRUE(old);
    EXPECT_EQ(*old, before);
    EXPECT_NE(followed(camera), before);
}

// The same of large meshes, whose clusters are looked at by themselves; and of what casts their shadows.
TEST_F(LookTest, AListOutlivesTheUpdateThatReplacesItsClusters) {
    TestScene built;
    built.setEnvironment(Vec3f::Constant(0.3f), Vec3f::Constant(0.1f), Vec3f::Zero());
    built.addDirectionalLight({0.3, -0.9, -0.2}, Vec3f::Ones(), 2, true);
    const ObjectId ball = built.add(makeTorus(0.5, 0.2, 100, 60));
    built.place(ball, Vec3d(0, 0.2, 0));
    built.place(built.add(makeBox({4, 0.1, 4})), Vec3d(0, -0.8, 0));
    follow(built.take());
    const ScreenCamera camera = cameraOf(kSidePx, kSidePx);
    RenderAction action(CullerKind::kFrustum);
    const auto listed = [&] { return action.run(scene_, camera, whole(camera), nullptr); };
    const auto drawn = [&](const DrawList& list) {
        restart({.samples = 1});
        auto picture = renderer_->draw(aspect_, list, camera, whole(camera));
        EXPECT_TRUE(picture);
        return picture ? *picture : Picture();
    };
    const DrawList list = listed();
    const auto clustered = [](const DrawItem& item) { return !item.clusters.empty(); };
    ASSERT_TRUE(std::ranges::any_of(list.opaque, clustered));
    ASSERT_TRUE(list.casters);
    std::size_t casters = 0;
    for (const auto& view : list.casters->all()) {
        for (const ShadowCaster& caster : view->moving) casters += clustered(caster.item);
        view->still->all.each([](const PixelRect&) { return true; },
                              [&](const ShadowCaster& caster) { casters += clustered(caster.item); });
    }
    ASSERT_GT(casters, 0u);
    const Picture before = drawn(list);
    MeshArrays larger = makeTorus(0.7, 0.3, 90, 70).toArrays();
    set<Geometry>(ball, fieldId<&Geometry::positions>, larger.positions);
    set<Geometry>(ball, fieldId<&Geometry::normals>, larger.normals);
    set<Geometry>(ball, fieldId<&Geometry::indices>, larger.indices);
    set<Geometry>(ball, fieldId<&Geometry::texcoords>, larger.texcoords);
    apply();
    const DrawList next = listed();
    EXPECT_EQ(drawn(list), before);
    EXPECT_NE(drawn(next), before);
}

// Numbers of what went are others' now, whoever comes: ever new scenes in one renderer.
TEST_F(LookTest, WhatIsGoneIsForgotten) {
    const ScreenCamera camera = cameraOf(kSidePx, kSidePx);
    for (int i = 0; i < 1100; ++i) {
        TestScene scene;
        scene.setDark();
        const float red = 0.2f + 0.5f * static_cast<float>(i % 100) / 100;
        scene.place(scene.add(makeSheet(4, 4), scene.add(unlit({red, 0.3f, 0.1f}))), Vec3d::Zero());
        const Picture picture = draw(scene.take(), camera);
        if (i % 50 == 0) expectNear(center(picture), expectedOf({red, 0.3f, 0.1f}));
    }
}

}  // namespace
}  // namespace tessera
