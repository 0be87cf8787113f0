#include "tests/bench/SceneMaker.h"

#include <cmath>

#include "common/cores/Camera.h"
#include "common/cores/CollisionObject.h"
#include "common/cores/DirectionalLight.h"
#include "common/cores/Geometry.h"
#include "common/cores/Interest.h"
#include "common/cores/Material.h"
#include "common/cores/PointLight.h"
#include "common/cores/Switch.h"
#include "common/cores/Transform.h"
#include "common/geometry/Mesh.h"
#include "common/scene/FieldTable.h"

namespace tessera::bench {
namespace {

constexpr std::uint64_t kShared = 16;      // meshes and materials
constexpr std::uint64_t kEditPlaces = 32;  // of each sort, spread over the tree
constexpr std::uint64_t kBelow = 10;
constexpr double kCell = 2;  // no shape is larger than 1

class Maker {
public:
    explicit Maker(const SceneWish& wish) : wish_(wish), next_(wish.firstId.value) {}

    ChangeList make() {
        for (std::uint64_t i = 0; i < kShared; ++i) {
            const double t = static_cast<double>(i) / kShared;
            const ObjectId look = material(Vec4f(float(0.2 + 0.5 * t), 0.5f, float(0.8 - 0.5 * t), 1));
            shared_.push_back(geometry(makeBox({0.5 + 0.5 * t, 0.8, 1 - 0.4 * t}), look));
        }
        tools();
        switch (wish_.shape) {
            case SceneShape::kBushy:
                bushy();
                break;
            case SceneShape::kWide:
                wide();
                break;
            case SceneShape::kChains:
                chains();
                break;
        }
        node(kRootNode, create<Camera>(), "camera");
        return list_.take();
    }

private:
    template <typename T>
    ObjectId create() {
        const ObjectId id{next_++};
        list_.create(id, typeOf<T>());
        return id;
    }
    ObjectId node(ObjectId parent, ObjectId core, const char* name = "") {
        const ObjectId id = create<Node>();
        if (core) list_.set(id, typeOf<Node>(), fieldId<&Node::core>, toValue(core));
        if (*name) list_.set(id, typeOf<Node>(), fieldId<&Node::name>, toValue(std::string(name)));
        list_.place(id, parent);
        return id;
    }
    ObjectId place(ObjectId parent, const Vec3d& at, const char* name = "") {
        const ObjectId core = create<Transform>();
        list_.set(core, typeOf<Transform>(), fieldId<&Transform::translation>, toValue(at));
        return node(parent, core, name);
    }
    ObjectId material(const Vec4f& color) {
        const ObjectId id = create<Material>();
        list_.set(id, typeOf<Material>(), fieldId<&Material::baseColor>, toValue(color));
        return id;
    }
    ObjectId geometry(const MeshData& mesh, ObjectId look) {
        const MeshArrays arrays = mesh.toArrays();
        const ObjectId id = create<Geometry>();
        list_.set(id, typeOf<Geometry>(), fieldId<&Geometry::positions>, toValue(arrays.positions));
        list_.set(id, typeOf<Geometry>(), fieldId<&Geometry::normals>, toValue(arrays.normals));
        list_.set(id, typeOf<Geometry>(), fieldId<&Geometry::indices>, toValue(arrays.indices));
        list_.set(id, typeOf<Geometry>(), fieldId<&Geometry::material>, toValue(look));
        return id;
    }
    /// Four things at places of their own and one at the middle: ten nodes.
    ObjectId ten(ObjectId parent, const Vec3d& at, const char* name) {
        const ObjectId top = place(parent, at, name);
        node(top, shared_[4]);
        for (int i = 0; i < 4; ++i)
            node(place(top, Vec3d(0, 0, kCell * (i + 1))), shared_[static_cast<std::size_t>(i)]);
        return top;
    }
    void tools() {
        const ObjectId top = node(kRootNode, {}, "tools");
        node(place(top, {-10, 0, 0}), shared_[0], "first shared");
        node(place(top, {-14, 0, 0}), shared_[1], "second shared");
        const ObjectId toggled = node(top, create<Switch>(), "toggled");
        ten(toggled, {-18, 0, 0}, "");
        ten(node(top, {}, "from"), {-22, 0, 0}, "moved");
        node(top, {}, "to");
        node(place(top, {-26, 5, 0}), create<PointLight>(), "lamp");
        node(top, create<DirectionalLight>(), "sun");
        const ObjectId crane = place(top, {-30, 0, 0}, "crane");
        node(crane, shared_[2]);
        const ObjectId body = create<CollisionObject>();
        list_.set(body, typeOf<CollisionObject>(), fieldId<&CollisionObject::node>, toValue(crane));
        node(crane, body);
        const ObjectId interest = create<Interest>();
        list_.set(interest, typeOf<Interest>(), fieldId<&Interest::object>, toValue(crane));
        node(top, interest);
    }
    /// Cell i of a cube of `count` cells.
    static Vec3d cell(std::uint64_t i, std::uint64_t count) {
        const auto edge = static_cast<std::uint64_t>(std::ceil(std::cbrt(static_cast<double>(count)) - 1e-9));
        return kCell * Vec3d(double(i % edge), double(i / edge % edge), double(i / edge / edge));
    }

    void bushy() {
        // Places, ten below each; the lowest have a Geometry node: p places of which nine tenths are leaves.
        const std::uint64_t places = wish_.size * kBelow / (2 * kBelow - 1);
        const std::uint64_t firstLeaf =
            (places + kBelow - 2) / kBelow;  // its first child would be beyond the last place
        const std::uint64_t leaves = places - firstLeaf;
        const std::uint64_t stride = std::max<std::uint64_t>(2, leaves / kEditPlaces);
        std::vector<ObjectId> at;
        for (std::uint64_t i = 0; i < places; ++i) {
            const ObjectId parent = i == 0 ? kRootNode : at[(i - 1) / kBelow];
            if (i < firstLeaf) {
                at.push_back(place(parent, Vec3d::Zero()));
                continue;
            }
            const std::uint64_t leaf = i - firstLeaf;
            const Vec3d where = cell(leaf, leaves);
            if (leaf % stride == stride / 2) {
                place(parent, where, "slot");
            } else if (leaf % stride == 0) {
                node(place(parent, where), geometry(makeBox({0.9, 0.9, 0.9}), material({0.5f, 0.5f, 0.5f, 1})), "own");
            } else {
                node(place(parent, where), shared_[leaf % kShared]);
            }
        }
    }
    void wide() {
        const ObjectId top = node(kRootNode, {}, "wide");
        for (std::uint64_t i = 0; i < wish_.size; ++i) node(place(top, cell(i, wish_.size)), shared_[i % kShared]);
    }
    void chains() {
        // The root is 1 deep, the Geometry node at the bottom as deep as can be.
        const std::uint64_t length = wish_.limits.maxDepth - 2;
        const std::uint64_t count = std::max<std::uint64_t>(3, wish_.size / (length + 1));
        for (std::uint64_t c = 0; c < count; ++c) {
            ObjectId parent = kRootNode;
            for (std::uint64_t i = 0; i < length; ++i)
                parent = place(parent, i == 0 ? cell(c, count) : Vec3d::Zero(), i + 1 == length ? "bottom" : "");
            node(parent, shared_[c % kShared]);
        }
    }

    SceneWish wish_;
    ChangeListBuilder list_;
    std::uint64_t next_;
    std::vector<ObjectId> shared_;
};

/// One of `count` objects, of which as many take turns in every scene: caches then hold as much of a large scene as of
/// a small one. Those that follow each other are far from each other.
std::size_t indexAt(std::size_t count, std::size_t turn, std::size_t turns = kEditPlaces) {
    return count * (turn * 7 % turns) / turns;
}
ObjectId at(const std::vector<ObjectId>& places, std::size_t turn) {
    return places[indexAt(places.size(), turn)];
}
/// The small scene has no more chains.
ObjectId bottomAt(const ScenePlaces& places, std::size_t turn) {
    return places.bottoms[indexAt(places.bottoms.size(), turn, 3)];
}
const ScenePlaces::Own& ownAt(const ScenePlaces& places, std::size_t turn) {
    return places.own[indexAt(places.own.size(), turn)];
}

ChangeList shift(const Aspect& scene, ObjectId transform, double by) {
    ChangeListBuilder list;
    const Vec3d to = scene.get<Transform>(transform)->translation + Vec3d(by, 0, 0);
    list.set(transform, typeOf<Transform>(), fieldId<&Transform::translation>, toValue(to));
    return list.take();
}

constexpr ObjectId placeholder(std::uint64_t number) {
    return ObjectId{kFirstPlaceholder + number};
}

ChangeList addLeaf(const ScenePlaces& places, const Aspect& scene, ObjectId parent) {
    ChangeListBuilder list;
    const Geometry& like = *scene.get<Geometry>(places.geometry[0]);
    list.create(placeholder(0), typeOf<Geometry>());
    list.set(placeholder(0), typeOf<Geometry>(), fieldId<&Geometry::positions>, toValue(like.positions));
    list.set(placeholder(0), typeOf<Geometry>(), fieldId<&Geometry::normals>, toValue(like.normals));
    list.set(placeholder(0), typeOf<Geometry>(), fieldId<&Geometry::indices>, toValue(like.indices));
    list.set(placeholder(0), typeOf<Geometry>(), fieldId<&Geometry::material>, toValue(places.material[0]));
    list.create(placeholder(1), typeOf<Node>());
    list.set(placeholder(1), typeOf<Node>(), fieldId<&Node::core>, toValue(placeholder(0)));
    list.place(placeholder(1), parent);
    return list.take();
}

/// Takes out a node and all below it, with those cores that nobody else uses.
void remove(ChangeListBuilder& list, const Aspect& scene, ObjectId id) {
    const Node& node = *scene.get<Node>(id);
    for (const ObjectId child : node.children) remove(list, scene, child);
    list.detach(id);
    list.destroy(id);
    if (node.core && scene.useCount(node.core) == 1) list.destroy(node.core);
}

ChangeList removeChild(const Aspect& scene, ObjectId parent, std::size_t index) {
    ChangeListBuilder list;
    remove(list, scene, scene.get<Node>(parent)->children[index]);
    return list.take();
}

ChangeList lastChildRemoved(const Aspect& scene, ObjectId parent) {
    return removeChild(scene, parent, scene.get<Node>(parent)->children.size() - 1);
}

/// A child of the wide node, as those that it has; `part` halves along them.
template <int part>
ChangeList insert(const ScenePlaces& places, const Aspect& scene, std::size_t, bool second) {
    const std::size_t children = scene.get<Node>(places.wide)->children.size() - (second ? 1 : 0);
    const std::size_t index = children * part / 2;
    if (second) return removeChild(scene, places.wide, index);
    ChangeListBuilder list;
    list.create(placeholder(0), typeOf<Transform>());
    list.set(placeholder(0), typeOf<Transform>(), fieldId<&Transform::translation>, toValue(Vec3d(0, -10, 0)));
    list.create(placeholder(1), typeOf<Node>());
    list.set(placeholder(1), typeOf<Node>(), fieldId<&Node::core>, toValue(placeholder(0)));
    list.place(placeholder(1), places.wide, static_cast<std::uint32_t>(index));
    list.create(placeholder(2), typeOf<Node>());
    list.set(placeholder(2), typeOf<Node>(), fieldId<&Node::core>, toValue(places.geometry[0]));
    list.place(placeholder(2), placeholder(1));
    return list.take();
}

const std::vector<EditKind> kBushyKinds = {
    {"a transform", "",
     [](const ScenePlaces& places, const Aspect& scene, std::size_t turn, bool second) {
         return shift(scene, ownAt(places, turn).transform, second ? -0.1 : 0.1);
     }},
    {"create and place a leaf with geometry", "remove a leaf with geometry",
     [](const ScenePlaces& places, const Aspect& scene, std::size_t turn, bool second) {
         const ObjectId slot = at(places.slots, turn);
         return second ? lastChildRemoved(scene, slot) : addLeaf(places, scene, slot);
     }},
    {"reparent a subtree of 10", "",
     [](const ScenePlaces& places, const Aspect&, std::size_t, bool second) {
         ChangeListBuilder list;
         list.place(places.moved, second ? places.from : places.to);
         return list.take();
     }},
    {"hide a subtree of 10 with a Switch", "show a subtree of 10 with a Switch",
     [](const ScenePlaces& places, const Aspect& scene, std::size_t, bool second) {
         ChangeListBuilder list;
         list.set(scene.get<Node>(places.toggled)->core, typeOf<Switch>(), fieldId<&Switch::choice>,
                  toValue(second ? Switch::kAll : Switch::kNone));
         return list.take();
     }},
    {"replace a Geometry's positions", "",
     [](const ScenePlaces& places, const Aspect& scene, std::size_t turn, bool second) {
         const ObjectId id = ownAt(places, turn).geometry;
         const std::span<const float> now = scene.get<Geometry>(id)->positions.as<float>();
         std::vector<float> next(now.begin(), now.end());
         // Never the same arrays twice: what deforms brings new ones.
         next[0] = std::nextafter(next[0], second ? 0.0f : 1.0f);
         next[1] = -0.45f + 1e-6f * static_cast<float>(turn);
         ChangeListBuilder list;
         list.set(id, typeOf<Geometry>(), fieldId<&Geometry::positions>,
                  toValue(Blob::of(std::span<const float>(next))));
         return list.take();
     }},
    {"a material's colour", "",
     [](const ScenePlaces& places, const Aspect&, std::size_t turn, bool second) {
         ChangeListBuilder list;
         list.set(ownAt(places, turn).material, typeOf<Material>(), fieldId<&Material::baseColor>,
                  toValue(Vec4f(second ? 0.5f : 0.9f, 0.5f, 0.5f, 1)));
         return list.take();
     }},
    {"another material for a Geometry", "",
     [](const ScenePlaces& places, const Aspect&, std::size_t turn, bool second) {
         const ScenePlaces::Own& own = ownAt(places, turn);
         ChangeListBuilder list;
         list.set(own.geometry, typeOf<Geometry>(), fieldId<&Geometry::material>,
                  toValue(second ? own.material : places.material[0]));
         return list.take();
     }},
    {"a light", "",
     [](const ScenePlaces& places, const Aspect& scene, std::size_t, bool second) {
         ChangeListBuilder list;
         list.set(scene.get<Node>(places.lamp)->core, typeOf<PointLight>(), fieldId<&PointLight::intensity>,
                  toValue(second ? 1.0f : 2.0f));
         return list.take();
     }},
    {"add an empty group", "remove an empty group",
     [](const ScenePlaces& places, const Aspect& scene, std::size_t turn, bool second) {
         const ObjectId slot = at(places.slots, turn);
         if (second) return lastChildRemoved(scene, slot);
         ChangeListBuilder list;
         list.create(placeholder(0), typeOf<Node>());
         list.place(placeholder(0), slot);
         return list.take();
     }},
};

const std::vector<EditKind> kWideKinds = {
    {"insert as the first child", "remove the first child", insert<0>},
    {"insert in the middle", "remove from the middle", insert<1>},
    {"insert as the last child", "remove the last child", insert<2>},
    {"the transform of one child", "",
     [](const ScenePlaces& places, const Aspect& scene, std::size_t turn, bool second) {
         const auto& children = scene.get<Node>(places.wide)->children;
         return shift(scene, scene.get<Node>(children[indexAt(children.size(), turn)])->core, second ? -0.1 : 0.1);
     }},
};

const std::vector<EditKind> kChainKinds = {
    {"the transform at a chain's bottom", "",
     [](const ScenePlaces& places, const Aspect& scene, std::size_t turn, bool second) {
         return shift(scene, scene.get<Node>(bottomAt(places, turn))->core, second ? -0.1 : 0.1);
     }},
    {"create and place a leaf at a chain's bottom", "remove a leaf at a chain's bottom",
     [](const ScenePlaces& places, const Aspect& scene, std::size_t turn, bool second) {
         const ObjectId bottom = bottomAt(places, turn);
         return second ? lastChildRemoved(scene, bottom) : addLeaf(places, scene, bottom);
     }},
};

}  // namespace

ChangeList makeScene(const SceneWish& wish) {
    return Maker(wish).make();
}

ScenePlaces findPlaces(const Aspect& scene) {
    ScenePlaces places;
    for (const ObjectId id : scene.ids()) {
        const Node* node = scene.get<Node>(id);
        if (!node || node->name.empty()) continue;
        const auto keepGeometry = [&](int number) {
            places.geometry[number] = node->core;
            places.material[number] = scene.coreOf<Geometry>(*node)->material;
        };
        if (node->name == "own")
            places.own.push_back({.transform = scene.get<Node>(node->parent)->core,
                                  .geometry = node->core,
                                  .material = scene.coreOf<Geometry>(*node)->material});
        if (node->name == "slot") places.slots.push_back(id);
        if (node->name == "bottom") places.bottoms.push_back(id);
        if (node->name == "wide") places.wide = id;
        if (node->name == "toggled") places.toggled = id;
        if (node->name == "moved") places.moved = id;
        if (node->name == "from") places.from = id;
        if (node->name == "to") places.to = id;
        if (node->name == "lamp") places.lamp = id;
        if (node->name == "first shared") keepGeometry(0);
        if (node->name == "second shared") keepGeometry(1);
    }
    return places;
}

std::span<const EditKind> editKinds(SceneShape shape) {
    switch (shape) {
        case SceneShape::kBushy:
            return kBushyKinds;
        case SceneShape::kWide:
            return kWideKinds;
        case SceneShape::kChains:
            break;
    }
    return kChainKinds;
}

}  // namespace tessera::bench
