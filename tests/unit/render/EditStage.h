/// Scenes of any size and shape with one of each kind of object that edits change, and one edit of each kind.
#pragma once

#include <cmath>
#include <functional>
#include <random>

#include "client/render/scene/SceneItems.h"
#include "common/cores/Image.h"
#include "common/cores/PointLight.h"
#include "common/cores/Switch.h"
#include "common/cores/Transform.h"
#include "tests/unit/render/TestScene.h"

namespace tessera {

enum class Layout {
    kBushy,  ///< ten children each
    kFlat,   ///< all below the root
    kDeep,   ///< chains down to the limit of depth
};

/// Things all over a cube, and one of each kind of object that edits change.
struct EditStage {
    TestScene scene;
    RenderScene all;
    std::vector<ObjectId> groups{kRootNode};
    ObjectId pose, group, leaf, core, otherCore, material, otherMaterial, image, choice, lamp, lampNode, environment;

    EditStage(Layout layout, int count) {
        std::mt19937 random(9);
        const double side = 4 * std::cbrt(count);
        std::uniform_real_distribution<double> place(-side, side);
        const auto anywhere = [&] { return Vec3d(place(random), place(random), place(random)); };
        const ObjectId shared = scene.geometry(makeBox({1, 1, 1}));
        ObjectId above = kRootNode;
        for (int i = 0; i < count; ++i) {
            if (layout == Layout::kBushy) above = groups[static_cast<std::size_t>(i / 10)];
            if (layout == Layout::kDeep) above = i % 250 == 0 ? kRootNode : groups.back();
            const ObjectId node = scene.node(scene.transform(anywhere() / (layout == Layout::kFlat ? 1 : 8)), above);
            groups.push_back(node);
            scene.node(shared, node);
        }
        image = scene.create(typeOf<Image>());
        setPixels(255);
        scene.edit.set(image, typeOf<Image>(), fieldId<&Image::widthPx>, toValue(std::int64_t{2}));
        scene.edit.set(image, typeOf<Image>(), fieldId<&Image::heightPx>, toValue(std::int64_t{2}));
        material = scene.material(1.0f);
        scene.edit.set(material, typeOf<Material>(), fieldId<&Material::baseColorImage>, toValue(image));
        otherMaterial = scene.material(0.5f);
        core = scene.geometry(makeBox({1, 1, 1}), material);
        otherCore = scene.geometry(makeTorus(1, 0.3, 8, 6));
        pose = scene.transform(anywhere());
        group = scene.node(pose, groups.back());
        leaf = scene.node(core, group);
        choice = scene.create(typeOf<Switch>());
        const ObjectId switched = scene.node(choice, group);
        scene.node(shared, switched);
        scene.node(otherCore, switched);
        lamp = scene.create(typeOf<PointLight>());
        lampNode = scene.node(lamp, group);
        environment = scene.create(typeOf<Environment>());
        scene.node(environment, group);
        scene.apply();
        all.update(scene.aspect, nullptr);
    }

    void setPixels(std::uint8_t alpha) {
        const std::vector<std::uint8_t> pixels(16, alpha);
        scene.edit.set(image, typeOf<Image>(), fieldId<&Image::pixels>, toValue(Blob::of(std::span(pixels))));
    }
    template <typename Core, typename Value>
    void set(ObjectId id, FieldId field, const Value& value) {
        scene.edit.set(id, typeOf<Core>(), field, toValue(value));
    }
};

/// One edit of the kind; `turn` counts them.
struct EditKind {
    const char* name;
    std::function<void(EditStage&, int turn)> edit;
};

inline const std::vector<EditKind>& editKinds() {
    static const std::vector<EditKind> all{
        {"move",
         [](EditStage& s, int turn) { s.set<Transform>(s.pose, fieldId<&Transform::translation>, Vec3d(turn, 0, 0)); }},
        {"create and place",
         [](EditStage& s, int turn) {
             s.scene.put(s.otherCore, {0, 1.0 * turn, 0}, Quatd::Identity(), Vec3d::Ones(), s.group);
         }},
        {"create below the root",
         [](EditStage& s, int turn) {
             s.scene.put(s.otherCore, {0, 1.0 * turn, 0});
         }},
        {"detach and put back",
         [](EditStage& s, int turn) { s.scene.edit.place(s.leaf, turn % 2 ? s.group : ObjectId()); }},
        {"destroy",
         [](EditStage& s, int turn) {
             const ObjectId node =
                 s.scene.aspect.get<Node>(s.groups[static_cast<std::size_t>(turn + 500)])->children.front();
             s.scene.edit.detach(node);
             s.scene.edit.destroy(node);
         }},
        {"place elsewhere",
         [](EditStage& s, int turn) { s.scene.edit.place(s.leaf, s.groups[static_cast<std::size_t>(turn + 1)]); }},
        {"place first of its siblings",
         [](EditStage& s, int turn) { s.scene.edit.place(turn % 2 ? s.lampNode : s.leaf, s.group, 0); }},
        {"another core",
         [](EditStage& s, int turn) { s.set<Node>(s.leaf, fieldId<&Node::core>, turn % 2 ? s.core : s.otherCore); }},
        {"switch",
         [](EditStage& s, int turn) {
             s.set<Switch>(s.choice, fieldId<&Switch::choice>, static_cast<std::int64_t>(turn % 4) - 2);
         }},
        {"deform",
         [](EditStage& s, int turn) {
             const MeshArrays arrays = makeBox({1, 1.0 + turn, 1}).toArrays();
             s.set<Geometry>(s.core, fieldId<&Geometry::positions>, arrays.positions);
         }},
        {"another material",
         [](EditStage& s, int turn) {
             s.set<Geometry>(s.core, fieldId<&Geometry::material>, turn % 2 ? s.material : s.otherMaterial);
         }},
        {"material",
         [](EditStage& s, int turn) {
             s.set<Material>(s.material, fieldId<&Material::baseColor>, Vec4f(1, 1, 1, turn % 2 ? 1.0f : 0.5f));
         }},
        {"image", [](EditStage& s, int turn) { s.setPixels(turn % 2 ? 255 : 128); }},
        {"light",
         [](EditStage& s, int turn) {
             s.set<PointLight>(s.lamp, fieldId<&PointLight::intensity>, 1.0f + static_cast<float>(turn));
         }},
        {"create a light", [](EditStage& s, int) { s.scene.node(s.lamp, s.group); }},
        {"environment",
         [](EditStage& s, int turn) {
             s.set<Environment>(s.environment, fieldId<&Environment::sky>,
                                Vec3f(Vec3f::Constant(static_cast<float>(turn % 7))));
         }},
    };
    return all;
}

}  // namespace tessera
