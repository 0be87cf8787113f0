// Whatever a scene has been through, what is drawn of it is what one would draw who has just come: random histories of
// all kinds of edits, a RenderScene that follows them beside one that starts anew.
#include <cstdlib>
#include <cstring>
#include <map>
#include <random>
#include <set>

#include "client/render/scene/SceneItems.h"
#include "common/cores/Billboard.h"
#include "common/cores/ComponentTransform.h"
#include "common/cores/DirectionalLight.h"
#include "common/cores/DistanceLOD.h"
#include "common/cores/Image.h"
#include "common/cores/MaterialGroup.h"
#include "common/cores/PointLight.h"
#include "common/cores/SpotLight.h"
#include "common/cores/Switch.h"
#include "common/geometry/Points.h"
#include "common/scene/Action.h"
#include "tests/unit/render/SceneComparison.h"
#include "tests/unit/render/TestScene.h"

namespace tessera {
namespace {

bool allOpaqueIn(const Blob& rgba) {
    for (std::size_t i = 3; i < rgba.bytes().size(); i += 4)
        if (std::to_integer<int>(rgba.bytes()[i]) != 255) return false;
    return true;
}

/// As glTF's alpha modes say it.
bool isTransparent(const Aspect& aspect, const Material& material, const Geometry& geometry) {
    if (material.transmission > 0) return true;
    if (material.alphaMode == Material::kAutoAlpha) return material.baseColor.w() < 1;
    if (material.alphaMode != Material::kBlend) return false;
    const auto* image = aspect.get<Image>(material.baseColorImage);
    const bool clear = image && (!image->pixels.resident() || !allOpaqueIn(image->pixels));
    return material.baseColor.w() < 1 || clear || !allOpaqueIn(geometry.colors);
}

/// What a user sees, read off the scene node after node in document order, by the words of the cores' headers.
class NaiveView {
public:
    struct Drawn {
        const Geometry* geometry;
        Affine3d world_T_node;
        ObjectId material;
        std::set<ObjectId> within;  ///< it, and the nodes that it is below
    };
    struct Shining {
        float intensity;
        Vec3d position;
        ObjectId scope;
        bool outside;
        /// Whether it lights something.
        [[nodiscard]] bool reaches(const Drawn& drawn) const {
            return !scope || drawn.within.contains(scope) != outside;
        }
    };
    std::map<std::uint64_t, Drawn> drawn;
    std::vector<Shining> lights;
    std::vector<Vec3f> skies;
    bool anyLight = false;  ///< hidden ones, those that are off and those that others see too

    NaiveView(const Aspect& aspect, std::size_t user, const Vec3d& head) : aspect_(aspect), user_(user), head_(head) {
        walk(kRootNode, Affine3d::Identity(), 0xff);
        // The first 32 of scopes that lights name, whoever sees them, count.
        const auto beyond = [&](const Shining& light) {
            return light.scope &&
                   std::find(scopes_.begin(), scopes_.begin() + std::min<std::ptrdiff_t>(32, std::ssize(scopes_)),
                             light.scope) == scopes_.begin() + std::min<std::ptrdiff_t>(32, std::ssize(scopes_));
        };
        std::erase_if(lights, beyond);
    }

private:
    /// `shownTo`: a bit each of the users that see it.
    void walk(ObjectId id, const Affine3d& world_T_parent, unsigned shownTo) {
        const bool seen = (shownTo >> user_ & 1) != 0;
        const Node& node = *aspect_.get<Node>(id);
        const Object core = node.core ? aspect_.find(node.core) : Object();
        Affine3d world_T_node = placeNode(aspect_, node, world_T_parent);
        if (const auto* billboard = core.as<Billboard>())
            world_T_node.linear() = world_T_parent.linear() * turnTowards(head_, billboard->axis, world_T_parent);
        above_.push_back(core);
        within_.push_back(id);
        const bool shownToAny = shownTo != 0;
        const auto light = [&](const auto* it) {
            if (!it) return;
            anyLight = true;
            if (shownToAny && it->on && it->scope &&
                std::find(scopes_.begin(), scopes_.end(), it->scope) == scopes_.end())
                scopes_.push_back(it->scope);
            if (!seen || !it->on) return;
            lights.push_back({it->intensity,
                              worldTransform(aspect_, attached(it->beacon) ? it->beacon : id).translation(), it->scope,
                              it->outside});
        };
        light(core.as<PointLight>());
        light(core.as<SpotLight>());
        light(core.as<DirectionalLight>());
        if (seen) {
            if (const auto* geometry = core.as<Geometry>())
                drawn[id.value] = {geometry, world_T_node, materialOf(*geometry), {within_.begin(), within_.end()}};
            if (const auto* environment = core.as<Environment>()) skies.push_back(environment->sky);
        }
        std::size_t index = 0;
        for (const ObjectId child : node.children) {
            unsigned shown = shownTo;
            if (const auto* choice = core.as<Switch>();
                choice && choice->choice != Switch::kAll && choice->choice != static_cast<std::int64_t>(index) &&
                !(choice->choice == Switch::kMask && index < 63 && (choice->mask >> index) % 2 == 1))
                shown = 0;
            for (std::size_t user = 0; core.is<DistanceLOD>() && user < 8; ++user) {
                const auto level = static_cast<std::size_t>(static_cast<std::uint64_t>(node.levels) /
                                                            (std::uint64_t{1} << (8 * user)) % 256);
                if (!(index == level || (index + 1 == node.children.size() && level > index))) shown &= ~(1u << user);
            }
            walk(child, world_T_node, shown);
            ++index;
        }
        above_.pop_back();
        within_.pop_back();
    }
    [[nodiscard]] bool attached(ObjectId id) const {
        const Node* node = aspect_.get<Node>(id);
        while (node && node->parent) node = aspect_.get<Node>(id = node->parent);
        return node && id == kRootNode;
    }
    [[nodiscard]] ObjectId materialOf(const Geometry& geometry) const {
        std::size_t from = 0;
        ObjectId nearest, over;
        for (std::size_t i = 0; i < above_.size(); ++i)
            if (const auto* group = above_[i].as<MaterialGroup>(); group && group->protects) from = i;
        for (std::size_t i = above_.size(); i-- > 0;) {
            const auto* group = above_[i].as<MaterialGroup>();
            if (!group || !group->material) continue;
            if (!group->overrides && !nearest) nearest = group->material;
            if (group->overrides && i >= from) over = group->material;
        }
        return over ? over : geometry.material ? geometry.material : nearest;
    }

    const Aspect& aspect_;
    std::size_t user_;
    Vec3d head_;
    std::vector<Object> above_;
    std::vector<ObjectId> within_, scopes_;
};

int crowdedWithLights = 0;  ///< scenes seen with more than sixteen lights
int differently = 0;        ///< scenes of which this user does not see all that others see, or sees something turned
int scopedLights = 0;       ///< pairs of a light with a scope and an item
int lentMaterials = 0;      ///< items with the material of a group

void expectAsTraversed(const RenderScene::Impl& all, const Aspect& aspect, std::size_t user, const Vec3d& head) {
    const NaiveView naive(aspect, user, head);
    std::map<std::uint64_t, std::uint32_t> items;
    bool unlike = false;
    for (std::uint32_t i = 0; i < all.items.size(); ++i) {
        if (!all.items[i].node) continue;
        EXPECT_NE(all.items[i].seenBy, 0) << "nobody sees node " << all.items[i].node.value;
        unlike = unlike || all.items[i].seenBy != 0xff || all.items[i].turned;
        if (all.items[i].seenBy >> user & 1)
            items.emplace(all.items[i].node.value, i);
        else
            EXPECT_TRUE(all.boxes[i].empty()) << "node " << all.items[i].node.value;
    }
    differently += unlike;
    std::size_t drawn = 0;
    for (const auto& [id, seen] : naive.drawn) {
        const Geometry& geometry = *seen.geometry;
        const bool points = geometry.primitive == Geometry::kPoints;
        const MeshArrays arrays{.positions = geometry.positions,
                                .normals = geometry.normals,
                                .colors = geometry.colors,
                                .texcoords = geometry.texcoords,
                                .indices = geometry.indices,
                                .kind = points ? MeshKind::kPoints : MeshKind::kTriangles,
                                .pointRadius = points ? geometry.pointRadius : 0};
        const auto found = items.find(id);
        // Without indices the vertices as they stand: three make a triangle.
        const bool enough = points ? !geometry.positions.empty()
                                   : !geometry.indices.empty() || geometry.positions.sizeBytes() >= 3 * 12;
        const bool drawable = checkMesh(arrays) && enough;
        EXPECT_EQ(found != items.end(), drawable) << "node " << id;
        if (found == items.end()) continue;
        ++drawn;
        const SceneItem& item = all.items[found->second];
        EXPECT_EQ(std::memcmp(item.world_T_item.data(), seen.world_T_node.data(), 16 * sizeof(double)), 0)
            << "node " << id;
        EXPECT_EQ(item.material, seen.material) << "node " << id;
        lentMaterials += item.lent ? 1 : 0;
        EXPECT_EQ(item.kind, points ? MeshKind::kPoints : MeshKind::kTriangles);
        EXPECT_EQ(item.mesh->shownRadius, points ? shownRadius(arrays) : 0.0);
        const auto* material = aspect.get<Material>(seen.material);
        EXPECT_EQ(item.transparent, material && isTransparent(aspect, *material, geometry)) << "node " << id;
    }
    EXPECT_EQ(drawn, items.size());
    EXPECT_EQ(all.environment.sky, naive.skies.empty() ? Environment().sky : naive.skies.front());
    if (naive.lights.size() > 16) ++crowdedWithLights;
    ASSERT_EQ(all.lights.size(), naive.anyLight ? naive.lights.size() : 3);
    for (std::size_t i = 0; naive.anyLight && i < naive.lights.size(); ++i) {
        EXPECT_EQ(all.lights[i].radiance, Vec3f::Constant(naive.lights[i].intensity)) << "light " << i;
        EXPECT_EQ(std::memcmp(&all.lights[i].position, &naive.lights[i].position, sizeof(Vec3d)), 0) << "light " << i;
        const LightItem& light = all.lights[i];
        for (const auto& [id, seen] : naive.drawn) {
            const auto found = items.find(id);
            if (found == items.end()) continue;
            DrawItem item;
            all.describe(found->second, item);
            const std::uint32_t scopes = item.scopes;
            const bool reached = light.scope == 0 || ((scopes >> (light.scope - 1) & 1) != 0) != light.outside;
            EXPECT_EQ(reached, naive.lights[i].reaches(seen)) << "light " << i << " and node " << id;
            scopedLights += light.scope != 0;
        }
    }
}

/// Edits a scene at random; knows nothing of it but what the aspect says.
class Editor {
public:
    /// One history in four is about lights: more of them than are used.
    explicit Editor(unsigned seed) : random_(seed), lightsOften_(seed % 4 == 3) {
        for (const auto& mesh : {makeBox({1, 1, 1}), makeSphere(1, 8), makeTorus(1, 0.3, 8, 6), MeshData{}})
            meshes_.push_back(mesh.toArrays());
        MeshData broken = makeBox({1, 2, 1});
        broken.indices[4] = 4711;
        meshes_.push_back(broken.toArrays());
        MeshData glassy = makeBox({2, 1, 1});
        glassy.colors.assign(glassy.positions.size() / 3 * 4, 128);
        meshes_.push_back(glassy.toArrays());
        for (const double radius : {0.0, 0.25}) {
            MeshData points = makeBox({3, 1, 2});
            points.indices.clear();
            points.primitive = Primitive::kPoints;
            points.pointRadius = radius;
            meshes_.push_back(points.toArrays());
        }
        meshes_.push_back(meshes_.front());
        meshes_.back().positions = absent(meshes_.back().positions);
        const std::vector<std::uint8_t> clear(16, 128), full(16, 255);
        images_ = {Blob::of(std::span(clear)), Blob::of(std::span(full)), {}};
        images_.push_back(absent(images_[1]));
    }

    TestScene scene;

    /// One list of up to eight edits, or what leads back from the last one not taken back yet. An impossible one comes
    /// to nothing.
    ChangeList step() {
        if (!undo_.empty() && pick(6) == 0) {
            ChangeList back = std::move(undo_.back());
            undo_.pop_back();
            EXPECT_TRUE(scene.aspect.apply(back));
            return back;
        }
        survey();
        for (std::size_t edits = pick(8) + 1; edits > 0; --edits) edit();
        ChangeList list = scene.edit.take();
        auto back = scene.aspect.applyWithInverse(list);
        if (!back) return {};
        undo_.push_back(std::move(*back));
        return list;
    }

private:
    static Blob absent(const Blob& blob) { return Blob::absent(blob.id(), blob.sizeBytes()); }
    std::size_t pick(std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(random_); }
    double uniform(double from, double to) { return std::uniform_real_distribution<double>(from, to)(random_); }
    ObjectId any(const std::vector<ObjectId>& ids) { return ids.empty() ? ObjectId() : ids[pick(ids.size())]; }
    std::vector<ObjectId>& of(ObjectType type) { return ids_[type.value]; }

    void survey() {
        for (auto& ids : ids_) ids.clear();
        for (const ObjectId id : scene.aspect.ids()) of(typeOf(scene.aspect.find(id))).push_back(id);
    }

    ObjectId create(ObjectType type) {
        const ObjectId id = scene.create(type);
        of(type).push_back(id);
        return id;
    }
    ObjectId anyCore() {
        constexpr ObjectType kTypes[] = {
            typeOf<Transform>(),        typeOf<Transform>(),     typeOf<Geometry>(),    typeOf<Geometry>(),
            typeOf<Geometry>(),         typeOf<Switch>(),        typeOf<PointLight>(),  typeOf<Group>(),
            typeOf<DirectionalLight>(), typeOf<Environment>(),   typeOf<SpotLight>(),   typeOf<ComponentTransform>(),
            typeOf<InverseTransform>(), typeOf<MaterialGroup>(), typeOf<DistanceLOD>(), typeOf<Billboard>()};
        const bool light = lightsOften_ && pick(3) > 0;
        const ObjectType type = light ? typeOf<PointLight>() : kTypes[pick(std::size(kTypes))];
        if (!light && pick(3) > 0 && !of(type).empty()) return any(of(type));
        const ObjectId core = create(type);
        if (type == typeOf<Transform>()) setTransform(core);
        if (type == typeOf<ComponentTransform>()) setComponents(core);
        if (type == typeOf<Geometry>()) {
            setArrays(core);
            setMaterial(core);
        }
        if (type == typeOf<Switch>()) setChoice(core);
        if (type == typeOf<PointLight>() || type == typeOf<DirectionalLight>() || type == typeOf<SpotLight>())
            setIntensity(core, type);
        if (type == typeOf<Environment>()) setSky(core);
        if (type == typeOf<MaterialGroup>()) setGroup(core);
        if (type == typeOf<Billboard>()) setAxis(core);
        return core;
    }
    void setTransform(ObjectId id) {
        if (!id) return;
        if (pick(12) == 0)
            return scene.place(id, {uniform(-3, 3), 0, 0}, Quatd::Identity(), Vec3d::Constant(pick(2) ? 1e200 : 1e12));
        // Few different values, so that some changes change nothing.
        const Quatd turned(pick(2) ? 1.0 : 0.5, static_cast<double>(pick(2)), 0.25, 0);
        scene.place(id, {static_cast<double>(pick(4)), 1, static_cast<double>(pick(3))}, turned,
                    {pick(3) ? 1.0 : -1.5, 1, 0.5});
    }
    void setComponents(ObjectId id) {
        if (!id) return;
        setField<&ComponentTransform::center>(scene.edit, id, Vec3d(static_cast<double>(pick(3)), 0, 1));
        setField<&ComponentTransform::scaleOrientation>(scene.edit, id, Quatd(1, 0, 0, static_cast<double>(pick(3))));
        setField<&ComponentTransform::scale>(scene.edit, id, Vec3d(1, pick(4) ? 2.0 : -1.0, 1));
    }
    void setArrays(ObjectId id) {
        if (!id) return;
        const MeshArrays& arrays = meshes_[pick(meshes_.size())];
        const ObjectType type = typeOf<Geometry>();
        scene.edit.set(id, type, fieldId<&Geometry::positions>, toValue(arrays.positions));
        scene.edit.set(id, type, fieldId<&Geometry::normals>, toValue(arrays.normals));
        scene.edit.set(id, type, fieldId<&Geometry::colors>, toValue(arrays.colors));
        scene.edit.set(id, type, fieldId<&Geometry::texcoords>, toValue(arrays.texcoords));
        scene.edit.set(id, type, fieldId<&Geometry::indices>, toValue(arrays.indices));
        // Now and then it says of triangles that they are points.
        const bool points = (arrays.kind == MeshKind::kPoints) != (pick(20) == 0);
        scene.edit.set(id, type, fieldId<&Geometry::primitive>,
                       toValue(points ? Geometry::kPoints : Geometry::kTriangles));
        scene.edit.set(id, type, fieldId<&Geometry::pointRadius>, toValue(arrays.pointRadius));
    }
    void setMaterial(ObjectId id) {
        if (!id) return;
        ObjectId material = pick(4) == 0 ? ObjectId() : any(of(typeOf<Material>()));
        if (pick(4) == 0) setColor(material = create(typeOf<Material>()));
        scene.edit.set(id, typeOf<Geometry>(), fieldId<&Geometry::material>, toValue(material));
    }
    void setColor(ObjectId id) {
        if (!id) return;
        const ObjectType type = typeOf<Material>();
        if (pick(2))
            scene.edit.set(id, type, fieldId<&Material::baseColor>, toValue(Vec4f(1, 1, 1, pick(3) ? 1.0f : 0.5f)));
        if (pick(2))
            scene.edit.set(id, type, fieldId<&Material::roughness>, toValue(static_cast<float>(uniform(0, 1))));
        if (pick(2)) {
            ObjectId image = pick(3) == 0 ? ObjectId() : any(of(typeOf<Image>()));
            if (pick(3) == 0) setPixels(image = create(typeOf<Image>()));
            const FieldId slots[] = {fieldId<&Material::baseColorImage>, fieldId<&Material::metallicRoughnessImage>,
                                     fieldId<&Material::normalImage>};
            scene.edit.set(id, type, slots[pick(3)], toValue(image));
        }
        if (pick(3) == 0)
            scene.edit.set(id, type, fieldId<&Material::alphaMode>, toValue(static_cast<std::int64_t>(pick(4))));
        if (pick(6) == 0) scene.edit.set(id, type, fieldId<&Material::clearcoat>, toValue(static_cast<float>(pick(2))));
        if (pick(6) == 0) scene.edit.set(id, type, fieldId<&Material::ior>, toValue(pick(2) ? 1.5f : 2.0f));
        if (pick(6) == 0)
            scene.edit.set(id, type, fieldId<&Material::transmission>, toValue(static_cast<float>(pick(2))));
    }
    void setPixels(ObjectId id) {
        if (!id) return;
        const Blob& pixels = images_[pick(images_.size())];
        scene.edit.set(id, typeOf<Image>(), fieldId<&Image::pixels>, toValue(pixels));
        scene.edit.set(id, typeOf<Image>(), fieldId<&Image::widthPx>,
                       toValue(static_cast<std::int64_t>(pixels.sizeBytes() / 4)));
        scene.edit.set(id, typeOf<Image>(), fieldId<&Image::heightPx>, toValue(std::int64_t{1}));
    }
    void setChoice(ObjectId id) {
        if (!id) return;
        if (pick(2) == 0)
            scene.edit.set(id, typeOf<Switch>(), fieldId<&Switch::mask>, toValue(static_cast<std::int64_t>(pick(128))));
        scene.edit.set(id, typeOf<Switch>(), fieldId<&Switch::choice>,
                       toValue(pick(2) == 0 ? Switch::kMask : static_cast<std::int64_t>(pick(6)) - 2));
    }
    void setIntensity(ObjectId id, ObjectType type) {
        if (id) scene.edit.set(id, type, fieldId<&PointLight::intensity>, toValue(static_cast<float>(uniform(0, 9))));
    }
    void setLamp(ObjectId id) {
        const bool point = scene.aspect.get<PointLight>(id);
        if (!point) return;
        setField<&PointLight::on>(scene.edit, id, pick(3) > 0);
        setField<&PointLight::beacon>(scene.edit, id, pick(3) ? any(of(typeOf<Node>())) : ObjectId());
        setField<&PointLight::scope>(scene.edit, id, pick(3) ? any(of(typeOf<Node>())) : ObjectId());
        setField<&PointLight::outside>(scene.edit, id, pick(2) == 0);
    }
    void setGroup(ObjectId id) {
        if (!id) return;
        setField<&MaterialGroup::material>(scene.edit, id, pick(4) ? any(of(typeOf<Material>())) : ObjectId());
        setField<&MaterialGroup::overrides>(scene.edit, id, pick(2) == 0);
        setField<&MaterialGroup::protects>(scene.edit, id, pick(4) == 0);
    }
    void setAxis(ObjectId id) {
        const Vec3d axes[] = {Vec3d::Zero(), Vec3d::UnitY(), Vec3d::UnitZ(), Vec3d(1, 2, 0)};
        if (id) setField<&Billboard::axis>(scene.edit, id, axes[pick(4)]);
    }
    /// Few levels, and often the same of all users.
    void setLevels(ObjectId node) {
        std::uint64_t levels = pick(4);
        for (int byte = 1; byte < 8; ++byte) levels |= (pick(2) ? levels & 0xff : pick(4)) << (8 * byte);
        scene.edit.set(node, typeOf<Node>(), fieldId<&Node::levels>, static_cast<std::int64_t>(levels));
    }
    void setSky(ObjectId id) {
        if (!id) return;
        const Vec3f sky = Vec3f::Constant(static_cast<float>(uniform(0, 1)));
        scene.edit.set(id, typeOf<Environment>(), fieldId<&Environment::sky>, toValue(sky));
    }

    /// With all below it, out of the tree and out of the world; `keep`: some of its children stay in the tree.
    void destroy(ObjectId node, bool keep) {
        std::vector<ObjectId> open{node};
        while (!open.empty()) {
            const ObjectId id = open.back();
            open.pop_back();
            const auto* gone = scene.aspect.get<Node>(id);
            if (!gone || id == kRootNode) return;
            if (gone->parent) scene.edit.detach(id);
            for (const ObjectId child : gone->children) {
                if (keep && pick(2))
                    scene.edit.place(child, kRootNode);
                else
                    open.push_back(child);
            }
            scene.edit.destroy(id);
        }
    }
    void edit() {
        std::vector<ObjectId>& nodes = of(typeOf<Node>());
        const ObjectId node = any(nodes);
        const bool crowded = nodes.size() > 70;
        switch (pick(20)) {
            case 0:
            case 1:
            case 2:
            case 3: {
                // A few nodes, below one that is there or in a tree of their own.
                if (crowded) return destroy(node, false);
                ObjectId above = pick(5) == 0 ? ObjectId() : node;
                for (std::size_t count = pick(4) + 1; count > 0; --count) {
                    const ObjectId id = create(typeOf<Node>());
                    if (const ObjectId core = pick(6) == 0 ? ObjectId() : anyCore())
                        scene.edit.set(id, typeOf<Node>(), fieldId<&Node::core>, toValue(core));
                    if (above) scene.edit.place(id, above, pick(3) ? Placement::kLast : 0);
                    if (pick(2) || !above) above = id;
                }
                return;
            }
            case 4:
                return scene.edit.detach(node);
            case 5:
            case 6: {
                const ObjectId parent = any(nodes);
                const auto* above = scene.aspect.get<Node>(parent);
                const std::size_t index = above ? pick(above->children.size() + 1) : 0;
                return scene.edit.place(node, parent, static_cast<std::uint32_t>(index));
            }
            case 7: {
                const auto* present = scene.aspect.get<Node>(node);
                if (!present || !present->parent) return;
                const auto& siblings = scene.aspect.get<Node>(present->parent)->children;
                return scene.edit.place(node, present->parent, static_cast<std::uint32_t>(pick(siblings.size())));
            }
            case 8:
                return destroy(node, pick(2) == 0);
            case 9: {
                const ObjectId core = pick(4) == 0 ? ObjectId() : anyCore();
                return scene.edit.set(node, typeOf<Node>(), fieldId<&Node::core>, toValue(core));
            }
            case 10:
            case 11:
                return setChoice(any(of(typeOf<Switch>())));
            case 17: {
                std::vector<ObjectId> bearers;
                for (const ObjectId id : nodes)
                    if (const Node* bearer = scene.aspect.get<Node>(id);
                        bearer && scene.aspect.coreOf<DistanceLOD>(*bearer))
                        bearers.push_back(id);
                return bearers.empty() ? void() : setLevels(any(bearers));
            }
            case 18:
                return pick(2) ? setGroup(any(of(typeOf<MaterialGroup>()))) : setAxis(any(of(typeOf<Billboard>())));
            case 19:
                return setLamp(any(of(typeOf<PointLight>())));
            case 12:
                return setTransform(any(of(typeOf<Transform>())));
            case 13:
                return setArrays(any(of(typeOf<Geometry>())));
            case 14:
                return setMaterial(any(of(typeOf<Geometry>())));
            case 15:
                return pick(2) ? setColor(any(of(typeOf<Material>()))) : setPixels(any(of(typeOf<Image>())));
            default:
                break;
        }
        if (pick(4) == 0) return removeUnused();
        if (pick(2)) return setSky(any(of(typeOf<Environment>())));
        const ObjectType type = pick(2) ? typeOf<PointLight>() : typeOf<DirectionalLight>();
        setIntensity(any(of(type)), type);
    }
    void removeUnused() {
        for (const ObjectId id : scene.aspect.ids())
            if (!scene.aspect.get<Node>(id) && scene.aspect.useCount(id) == 0) scene.edit.destroy(id);
    }

    std::mt19937 random_;
    bool lightsOften_;
    std::array<std::vector<ObjectId>, 64> ids_;
    std::vector<MeshArrays> meshes_;
    std::vector<Blob> images_;
    std::vector<ChangeList> undo_;
};

/// Lists that changed something.
int runHistory(unsigned seed, int steps) {
    Editor editor(seed);
    RenderScene followed;
    followed.update(editor.scene.aspect, nullptr);
    int done = 0;
    ScreenCamera camera = TestCamera().camera();
    std::mt19937 looking(seed);
    for (int step = 0; step < steps; ++step) {
        const ChangeList list = editor.step();
        done += list.empty() ? 0 : 1;
        followed.update(editor.scene.aspect, &list);
        RenderScene anew;
        anew.update(editor.scene.aspect, nullptr);
        if (looking() % 2 == 0) camera.user = static_cast<unsigned>(looking() % 10);
        if (looking() % 2 == 0)
            camera.headWorld = Vec3d(static_cast<double>(looking() % 5), 1, static_cast<double>(looking() % 5) - 2);
        const RenderScene::Impl& seen = followed.seenFrom(camera);
        (void)anew.seenFrom(camera);
        expectSame(followed, anew);
        if (!testing::Test::HasFailure())
            expectAsTraversed(seen, editor.scene.aspect, camera.user % 8, camera.headWorld);
        if (testing::Test::HasFailure()) {
            ADD_FAILURE() << "step " << step << " of history " << seed << "; repeat it with TESSERA_HISTORY=" << seed
                          << " unit_render --gtest_filter=SceneHistory.*";
            return done;
        }
    }
    return done;
}

TEST(SceneHistory, FollowingItEqualsStartingAnew) {
    const char* one = std::getenv("TESSERA_HISTORY");
    const unsigned first = one ? static_cast<unsigned>(std::strtoul(one, nullptr, 10)) : 0;
    int done = 0;
    for (unsigned seed = first; seed < (one ? first + 1 : 400); ++seed) {
        done += runHistory(seed, 60);
        if (HasFailure()) return;
    }
    if (!one) {
        EXPECT_GT(done, 400 * 20) << "most lists were refused: this proves little";
        EXPECT_GT(crowdedWithLights, 200);
        EXPECT_GT(differently, 400);
        EXPECT_GT(lentMaterials, 200);
        EXPECT_GT(scopedLights, 2000);
    }
    RecordProperty("lists", done);
}

}  // namespace
}  // namespace tessera
