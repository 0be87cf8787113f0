/// The small lit test image by which hosts find out whether their pixels are the same.
///
/// Everything in it is written down as numbers: a mesh made with sine and cosine would compare the machines' C
/// libraries. Every kind of program is used once, so that it is compiled before the first frame.
#include <array>
#include <cstdint>
#include <map>
#include <memory>

#include "client/draw/passes/Renderer.h"
#include "common/cores/Geometry.h"
#include "common/cores/Image.h"
#include "common/math/Compose.h"
#include "common/scene/FieldTable.h"

namespace tessera {
namespace {

constexpr int kSidePx = 96;

constexpr std::array<float, 15> kPyramid{-1, -1, -1, 1, -1, -1, 1, -1, 1, -1, -1, 1, 0, 1, 0};
constexpr std::array<float, 15> kNormals{-0.6f, -0.48f, -0.64f, 0.6f,  -0.48f, -0.64f, 0.6f, -0.48f,
                                         0.64f, -0.6f,  -0.48f, 0.64f, 0,      1,      0};
constexpr std::array<float, 10> kTexcoords{0, 0, 2.5f, 0, 2.5f, 2.5f, 0, 2.5f, 1.25f, 1.25f};
constexpr std::array<std::uint8_t, 20> kColors{255, 64,  32,  255, 32, 255, 64,  255, 64,  32,
                                               255, 255, 255, 255, 64, 255, 200, 200, 200, 255};
constexpr std::array<std::uint32_t, 18> kTriangles{0, 4, 1, 1, 4, 2, 2, 4, 3, 3, 4, 0, 0, 1, 2, 0, 2, 3};

template <typename T, std::size_t N>
Blob blobOf(const std::array<T, N>& values) {
    return Blob::of(std::span<const T>(values));
}

Blob checkerboard() {
    std::array<std::uint8_t, 8 * 8 * 4> pixels{};
    for (std::size_t i = 0; i < 64; ++i) {
        const bool light = ((i / 8) ^ (i % 8)) & 1;
        for (std::size_t c = 0; c < 3; ++c) pixels[4 * i + c] = static_cast<std::uint8_t>((light ? 230 : 25) + 3 * c);
        pixels[4 * i + 3] = 255;
    }
    return blobOf(pixels);
}

constexpr ObjectId kSmooth{2}, kFaceted{3}, kPlain{4}, kPicture{5}, kGlass{6}, kSheet{7}, kImage{8}, kGlassPicture{9};

Expected<Aspect> probeScene() {
    ChangeListBuilder list;
    const auto set = [&](ObjectId id, ObjectType type, FieldId field, const auto& value) {
        list.set(id, type, field, toValue(value));
    };
    for (const ObjectId id : {kSmooth, kFaceted}) {
        const ObjectType type = typeOf<Geometry>();
        list.create(id, type);
        set(id, type, fieldId<&Geometry::positions>, blobOf(kPyramid));
        set(id, type, fieldId<&Geometry::indices>, blobOf(kTriangles));
        set(id, type, fieldId<&Geometry::texcoords>, blobOf(kTexcoords));
        if (id == kFaceted) continue;
        set(id, type, fieldId<&Geometry::normals>, blobOf(kNormals));
        set(id, type, fieldId<&Geometry::colors>, blobOf(kColors));
    }
    list.create(kImage, typeOf<Image>());
    set(kImage, typeOf<Image>(), fieldId<&Image::pixels>, checkerboard());
    set(kImage, typeOf<Image>(), fieldId<&Image::widthPx>, std::int64_t{8});
    set(kImage, typeOf<Image>(), fieldId<&Image::heightPx>, std::int64_t{8});
    for (const ObjectId id : {kPlain, kPicture, kGlass, kSheet, kGlassPicture}) {
        const ObjectType type = typeOf<Material>();
        const bool glass = id == kGlass || id == kGlassPicture;
        list.create(id, type);
        set(id, type, fieldId<&Material::baseColor>,
            glass ? Vec4f(0.2f, 0.5f, 0.9f, 0.4f) : Vec4f(0.9f, 0.7f, 0.4f, 1.0f));
        set(id, type, fieldId<&Material::metallic>, id == kPlain ? 1.0f : 0.0f);
        set(id, type, fieldId<&Material::roughness>, id == kPicture ? 0.8f : 0.25f);
        if (id == kPicture || id == kGlassPicture) set(id, type, fieldId<&Material::baseColorImage>, kImage);
        if (id == kSheet) set(id, type, fieldId<&Material::doubleSided>, true);
    }
    Aspect aspect;
    if (auto applied = aspect.apply(list.take()); !applied) return failWith("the probe's scene", applied.error());
    return aspect;
}

/// Geometries and materials of the probe's scene, as lists name them.
struct ProbeThings {
    explicit ProbeThings(const Aspect& scene) {
        for (const ObjectId id : {kSmooth, kFaceted}) meshes[id] = drawMeshOf(drawableOf(scene, id));
        for (const ObjectId id : {kPlain, kPicture, kGlass, kSheet, kGlassPicture})
            materials[id] = drawMaterialOf(scene, id);
    }
    std::map<ObjectId, std::shared_ptr<const DrawMesh>> meshes;
    std::map<ObjectId, std::shared_ptr<const DrawMaterial>> materials;
};

DrawItem itemAt(const ProbeThings& things, ObjectId geometry, ObjectId material, const Vec3d& position,
                const Vec3d& scale) {
    DrawItem item{.node = ObjectId{100},
                  .geometry = geometry,
                  .material = material,
                  .mesh = things.meshes.at(geometry),
                  .look = things.materials.at(material),
                  .world_T_item = Affine3d::Identity(),
                  .mirrored = scale.x() * scale.y() * scale.z() < 0};
    item.world_T_item = composeTransform(position, Quatd(0.8, 0.36, 0.48, 0.0), scale);
    return item;
}

DrawList probeList(const Aspect& scene) {
    DrawList list;
    const ProbeThings things(scene);
    const Vec3d size = Vec3d::Constant(0.55);
    const Vec3d mirrored(-0.55, 0.55, 0.55);
    for (const bool mirror : {false, true}) {
        const double y = mirror ? -0.8 : 0.8;
        const Vec3d& scale = mirror ? mirrored : size;
        list.opaque.push_back(itemAt(things, kSmooth, kPlain, {-1.3, y, 0}, scale));
        list.opaque.push_back(itemAt(things, kFaceted, kPicture, {0, y, -0.2}, scale));
        list.opaque.push_back(itemAt(things, kFaceted, kSheet, {1.3, y, -0.4}, scale));
        list.opaque.push_back(itemAt(things, kSmooth, kPicture, {0.6, y, -1.5}, scale));
        list.transparent.push_back(itemAt(things, kSmooth, kGlass, {-0.6, y, 0.6}, scale));
        list.transparent.push_back(itemAt(things, kSmooth, kGlassPicture, {0.7, y, 0.6}, scale));
    }
    list.lights.push_back({.kind = LightItem::Kind::kDirectional,
                           .direction = Vec3d(-0.48, -0.6, -0.64),
                           .radiance = Vec3f(0.9f, 0.85f, 0.8f)});
    list.lights.push_back({.kind = LightItem::Kind::kPoint,
                           .position = Vec3d(1.5, 1.0, 2.0),
                           .radiance = Vec3f(2.0f, 2.2f, 2.5f),
                           .range = 6.0f});
    return list;
}

ScreenCamera probeCamera() {
    ScreenCamera camera{.eyeWorld = Vec3d(0, 0, 5),
                        .eye_T_world = Affine3d(Eigen::Translation3d(0, 0, -5)),
                        .clip_T_eye = Mat4d::Zero(),
                        .pixels = {.width = kSidePx, .height = kSidePx}};
    constexpr double kNear = 0.5, kFar = 20;
    camera.clip_T_eye(0, 0) = 2.25;
    camera.clip_T_eye(1, 1) = 2.25;
    camera.clip_T_eye(2, 2) = -(kFar + kNear) / (kFar - kNear);
    camera.clip_T_eye(2, 3) = -2 * kFar * kNear / (kFar - kNear);
    camera.clip_T_eye(3, 2) = -1;
    return camera;
}

}  // namespace

Expected<std::uint64_t> Renderer::pixelProbe() {
    const auto scene = probeScene();
    if (!scene) return tl::unexpected(scene.error());
    const auto picture =
        draw(*scene, probeList(*scene), probeCamera(), {.x = 0, .y = 0, .width = kSidePx, .height = kSidePx});
    if (!picture) return tl::unexpected(picture.error());
    return hash64(std::as_bytes(std::span(picture->rgb)));
}

}  // namespace tessera
