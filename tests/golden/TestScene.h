/// Hand-made scenes for tests that look at pictures.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "common/cores/ComponentTransform.h"
#include "common/cores/DirectionalLight.h"
#include "common/cores/Environment.h"
#include "common/cores/Geometry.h"
#include "common/cores/Image.h"
#include "common/cores/InverseTransform.h"
#include "common/cores/Material.h"
#include "common/cores/NurbsSurface.h"
#include "common/cores/PointLight.h"
#include "common/cores/SpotLight.h"
#include "common/cores/SubdivisionSurface.h"
#include "common/cores/SurfaceParts.h"
#include "common/cores/Transform.h"
#include "common/geometry/Mesh.h"
#include "common/scene/Aspect.h"
#include "common/scene/FieldTable.h"
#include "common/wall/View.h"

namespace tessera::test {

/// Collects a scene object by object; `take` applies it to an empty aspect.
class TestScene {
public:
    ObjectId add(const MeshData& mesh, ObjectId material = {}) { return add(mesh.toArrays(), material); }
    ObjectId add(const MeshArrays& arrays, ObjectId material = {}) {
        const ObjectId id = create<Geometry>();
        set<Geometry>(id, fieldId<&Geometry::positions>, arrays.positions);
        if (!arrays.normals.empty()) set<Geometry>(id, fieldId<&Geometry::normals>, arrays.normals);
        if (!arrays.colors.empty()) set<Geometry>(id, fieldId<&Geometry::colors>, arrays.colors);
        if (!arrays.texcoords.empty()) set<Geometry>(id, fieldId<&Geometry::texcoords>, arrays.texcoords);
        if (!arrays.texcoords1.empty()) set<Geometry>(id, fieldId<&Geometry::texcoords1>, arrays.texcoords1);
        if (!arrays.tangents.empty()) set<Geometry>(id, fieldId<&Geometry::tangents>, arrays.tangents);
        const bool lines = arrays.kind == MeshKind::kLines;
        set<Geometry>(id, fieldId<&Geometry::indices>, lines ? arrays.lines : arrays.indices);
        if (lines) {
            set<Geometry>(id, fieldId<&Geometry::primitive>, Geometry::kLines);
            set<Geometry>(id, fieldId<&Geometry::lineWidth>, arrays.lineWidth);
        }
        if (arrays.kind == MeshKind::kPoints) {
            set<Geometry>(id, fieldId<&Geometry::primitive>, Geometry::kPoints);
            set<Geometry>(id, fieldId<&Geometry::pointRadius>, arrays.pointRadius);
        }
        if (material) set<Geometry>(id, fieldId<&Geometry::material>, material);
        return id;
    }
    ObjectId add(const SubdivisionSurface& surface) {
        const ObjectId id = create<SubdivisionSurface>();
        setAllFields(list_, id, Object::of(surface));
        return id;
    }
    ObjectId add(const NurbsSurfaceCore& surface) {
        const ObjectId id = create<NurbsSurfaceCore>();
        setAllFields(list_, id, Object::of(surface));
        return id;
    }
    ObjectId add(const Material& material) {
        const ObjectId id = create<Material>();
        setAllFields(list_, id, Object::of(material));
        return id;
    }
    template <typename T>
    ObjectId addCore(const T& core) {
        const ObjectId id = create<T>();
        setAllFields(list_, id, Object::of(core));
        return id;
    }
    ObjectId add(const SurfaceProgram& program) {
        const ObjectId id = create<SurfaceProgram>();
        setAllFields(list_, id, Object::of(program));
        return id;
    }
    ObjectId add(const Uniform& uniform) {
        const ObjectId id = create<Uniform>();
        setAllFields(list_, id, Object::of(uniform));
        return id;
    }
    ObjectId addImage(const Blob& pixels, int widthPx, int heightPx) {
        return add(Image{.pixels = pixels, .widthPx = widthPx, .heightPx = heightPx});
    }
    ObjectId add(const Image& image) {
        const ObjectId id = create<Image>();
        setAllFields(list_, id, Object::of(image));
        return id;
    }
    /// A light of sky and ground, and the colour of what is empty.
    void setEnvironment(const Vec3f& sky, const Vec3f& ground, const Vec3f& background) {
        const ObjectId id = create<Environment>();
        set<Environment>(id, fieldId<&Environment::sky>, sky);
        set<Environment>(id, fieldId<&Environment::ground>, ground);
        set<Environment>(id, fieldId<&Environment::background>, background);
        addNode(id);
    }
    void addEnvironment(const Environment& environment) {
        const ObjectId id = create<Environment>();
        setAllFields(list_, id, Object::of(environment));
        addNode(id);
    }
    /// Only what is emitted can be seen: no ambient light, and a lamp without power, since a scene without lamps is
    /// given some.
    void setDark(const Vec3f& background = Vec3f::Zero()) {
        setEnvironment(Vec3f::Zero(), Vec3f::Zero(), background);
        addDirectionalLight(-Vec3d::UnitZ(), Vec3f::Ones(), 0);
    }
    void addPointLight(const Vec3d& position, const Vec3f& color, float intensity, float range = 0,
                       const Vec3f& attenuation = Vec3f(0, 0, 1), bool shadows = false) {
        const ObjectId id = create<PointLight>();
        if (shadows) set<PointLight>(id, fieldId<&PointLight::shadows>, true);
        if (attenuation != PointLight().attenuation)
            set<PointLight>(id, fieldId<&PointLight::attenuation>, attenuation);
        set<PointLight>(id, fieldId<&PointLight::color>, color);
        set<PointLight>(id, fieldId<&PointLight::intensity>, intensity);
        set<PointLight>(id, fieldId<&PointLight::range>, range);
        addNode(id, addTransform(position));
    }
    /// Angles in radians from the axis, which is `direction`.
    void addSpotLight(const Vec3d& position, const Vec3d& direction, const Vec3f& color, float intensity,
                      float innerAngle, float outerAngle, float range = 0, bool shadows = false) {
        const ObjectId id = create<SpotLight>();
        if (shadows) set<SpotLight>(id, fieldId<&SpotLight::shadows>, true);
        set<SpotLight>(id, fieldId<&SpotLight::color>, color);
        set<SpotLight>(id, fieldId<&SpotLight::intensity>, intensity);
        set<SpotLight>(id, fieldId<&SpotLight::range>, range);
        set<SpotLight>(id, fieldId<&SpotLight::innerAngle>, innerAngle);
        set<SpotLight>(id, fieldId<&SpotLight::outerAngle>, outerAngle);
        addNode(id, addTransform(position, Quatd::FromTwoVectors(-Vec3d::UnitZ(), direction)));
    }
    /// A geometry, turned and stretched about a centre.
    ObjectId placeAbout(ObjectId geometry, const ComponentTransform& about, ObjectId parent = kRootNode) {
        const ObjectId id = create<ComponentTransform>();
        setAllFields(list_, id, Object::of(about));
        return addNode(geometry, addNode(id, parent));
    }
    /// A node whose children stand in the world, wherever it hangs itself.
    ObjectId addInverse(ObjectId parent) { return addNode(create<InverseTransform>(), parent); }
    /// Travels along `direction`.
    void addDirectionalLight(const Vec3d& direction, const Vec3f& color, float intensity, bool shadows = false) {
        const ObjectId id = create<DirectionalLight>();
        if (shadows) set<DirectionalLight>(id, fieldId<&DirectionalLight::shadows>, true);
        set<DirectionalLight>(id, fieldId<&DirectionalLight::color>, color);
        set<DirectionalLight>(id, fieldId<&DirectionalLight::intensity>, intensity);
        addNode(id, addTransform(Vec3d::Zero(), Quatd::FromTwoVectors(-Vec3d::UnitZ(), direction)));
    }
    ObjectId addTransform(const Vec3d& translation, const Quatd& rotation = Quatd::Identity(),
                          const Vec3d& scale = Vec3d::Ones(), ObjectId parent = kRootNode) {
        const ObjectId id = create<Transform>();
        set<Transform>(id, fieldId<&Transform::translation>, translation);
        set<Transform>(id, fieldId<&Transform::rotation>, rotation);
        set<Transform>(id, fieldId<&Transform::scale>, scale);
        return addNode(id, parent);
    }
    ObjectId addNode(ObjectId core, ObjectId parent = kRootNode) {
        const ObjectId id = create<Node>();
        set<Node>(id, fieldId<&Node::core>, core);
        list_.place(id, parent);
        return id;
    }
    /// A geometry at a place: the node that holds it.
    ObjectId place(ObjectId geometry, const Vec3d& translation, const Quatd& rotation = Quatd::Identity(),
                   const Vec3d& scale = Vec3d::Ones()) {
        return addNode(geometry, addTransform(translation, rotation, scale));
    }

    [[nodiscard]] Aspect take() {
        Aspect aspect;
        const auto applied = aspect.apply(list_.take());
        EXPECT_TRUE(applied) << applied.error().message;
        return aspect;
    }

private:
    template <typename T>
    ObjectId create() {
        const ObjectId id{next_++};
        list_.create(id, typeOf<T>());
        return id;
    }
    template <typename T, typename Value>
    void set(ObjectId id, FieldId field, const Value& value) {
        list_.set(id, typeOf<T>(), field, toValue(value));
    }

    ChangeListBuilder list_;
    std::uint64_t next_ = 2;  // 1 is the root
};

/// A rectangle in the plane z = 0 that faces +Z, with texture coordinates.
[[nodiscard]] inline MeshData makeSheet(double width, double height, float repeats = 1) {
    const auto w = static_cast<float>(width / 2), h = static_cast<float>(height / 2);
    MeshData mesh;
    mesh.positions = {-w, -h, 0, w, -h, 0, w, h, 0, -w, h, 0};
    mesh.normals = {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1};
    mesh.texcoords = {0, repeats, repeats, repeats, repeats, 0, 0, 0};
    mesh.indices = {0, 1, 2, 0, 2, 3};
    return mesh;
}

/// Lines from end to end, `width` pixels wide.
[[nodiscard]] inline MeshData makeLines(std::span<const Vec3d> ends, float width) {
    MeshData mesh;
    mesh.primitive = Primitive::kLines;
    mesh.lineWidth = width;
    for (const Vec3d& end : ends) {
        mesh.lines.push_back(static_cast<std::uint32_t>(mesh.positions.size() / 3));
        for (const double value : end) mesh.positions.push_back(static_cast<float>(value));
    }
    return mesh;
}

/// A flat screen of width x height metres around the origin in the plane z = 0, seen from `eye`.
[[nodiscard]] inline ScreenCamera cameraOf(int widthPx, int heightPx, const Vec3d& eye = {0, 0, 2.4},
                                           double widthMetres = 3.2, const View& view = {}) {
    const double heightMetres = widthMetres * heightPx / widthPx;
    Screen screen;
    screen.lowerLeft = {-widthMetres / 2, -heightMetres / 2, 0};
    screen.lowerRight = {widthMetres / 2, -heightMetres / 2, 0};
    screen.upperLeft = {-widthMetres / 2, heightMetres / 2, 0};
    screen.grid.tileWidthPx = widthPx;
    screen.grid.tileHeightPx = heightPx;
    User user;
    user.position = eye;
    return screenCamera(screen, user, Eye::kCenter, view);
}

}  // namespace tessera::test
