#include "server/import/ContentCores.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <span>
#include <string>

#include "common/scene/ChildChoice.h"
#include "common/scene/Cores.h"
#include "server/import/CollisionCores.h"
#include "server/import/InlineCores.h"
#include "server/import/TableCores.h"
#include "server/import/WrittenCores.h"

namespace tessera {

struct ContentCores::Kind {
    using Content = proto::scene::Node::ContentCase;
    Content content;
    std::string_view name = "node";
    Expected<ObjectId> (ContentCores::*make)(const Asked&) = &ContentCores::ofTable;
    bool holdsChildren = false;  ///< beside what the table of types knows: poses and choices
};

const ContentCores::Kind* ContentCores::kindOf(const proto::scene::Node& node) {
    using C = ContentCores;
    using Content = Kind::Content;
    static constexpr std::array kKinds = {
        Kind{Content::CONTENT_NOT_SET, "node", &C::nothing},
        Kind{Content::kImport, "node", &C::nothing},
        Kind{Content::kInstance, "node", &C::nothing},
        Kind{Content::kGeometry, "geometry", &C::drawn},
        Kind{Content::kSubdivisionSurface, "surface", &C::drawn},
        Kind{Content::kNurbsSurface, "surface", &C::drawn},
        Kind{Content::kText, "node", &C::drawn},
        Kind{Content::kParticles, "node", &C::drawn},
        Kind{Content::kGlyphs, "node", &C::drawn},
        Kind{Content::kVolume, "node", &C::drawn},
        Kind{Content::kSkin, "skin", &C::drawn},
        Kind{Content::kDirectionalLight, "light"},
        Kind{Content::kPointLight, "light"},
        Kind{Content::kSpotLight, "light"},
        Kind{Content::kComponentTransform, "transform"},
        Kind{Content::kInverseTransform, "transform"},
        Kind{Content::kManipulator, "manipulator"},
        Kind{Content::kCamera, "camera", &C::camera},
        Kind{Content::kSwitch, "switch", &C::choice},
        Kind{Content::kMaterialGroup, "material_group", &C::materialGroup, true},
        Kind{Content::kDistanceLod, "distance_lod", &C::levels},
        Kind{Content::kBillboard, "billboard", &C::billboard, true},
        Kind{Content::kMotion, "motion", &C::motion},
        Kind{Content::kAnimation, "animation", &C::animation},
        Kind{Content::kEnvironment, "environment", &C::surroundings},
        Kind{Content::kInterest, "interest", &C::interest},
        Kind{Content::kCollisionObject, "collision_object", &C::collisionObject},
        Kind{Content::kInline, "inline", &C::inlined},
        Kind{Content::kProxyGroup, "proxy_group", &C::inlined},
        Kind{Content::kApplicationData, "application_data", &C::applicationData},
        Kind{Content::kMovie, "movie", &C::movie},
        Kind{Content::kCore, "core", &C::written},
    };
    for (const Kind& kind : kKinds)
        if (kind.content == node.content_case()) return &kind;
    return nullptr;
}

std::string_view ContentCores::nameFor(const proto::scene::Node& node) {
    const Kind* kind = kindOf(node);
    return kind ? kind->name : "node";
}

bool ContentCores::holdsChildren(const proto::scene::Node& node) {
    const TypeInfo* type = tableTypeOf(node);
    const Kind* kind = kindOf(node);
    return type && (type->pose || type->effects & Effect::kVisibility || (kind && kind->holdsChildren));
}

bool ContentCores::moves(const proto::scene::Node& node) {
    const TypeInfo* type = tableTypeOf(node);
    return type && type->pose;
}

Expected<ObjectId> ContentCores::make(LoadedFile& file, const proto::scene::Node& node, const Spot& spot) {
    const Kind* kind = kindOf(node);
    const Asked asked{file, node, spot};
    return kind ? (this->*kind->make)(asked) : ofTable(asked);
}

Expected<ObjectId> ContentCores::nothing(const Asked&) {
    return ObjectId{};
}

Expected<ObjectId> ContentCores::ofTable(const Asked& asked) {
    const TypeInfo* type = tableTypeOf(asked.node);
    if (!type) return fail(ErrorCode::kBadInput, "it is not in plain form (shapes are made into meshes by the reader)");
    const Expected<TableFields> fields = readTableFields(contentOf(asked.node), *type);
    if (!fields) return tl::unexpected(fields.error());
    const ObjectId id = draft_.createObject(type->freshObject());
    for (const auto& [field, value] : *fields) draft_.list().set(id, type->type, field, value);
    return id;
}

Expected<ObjectId> ContentCores::written(const Asked& asked) {
    return makeWritten(draft_, materials_, asked.file, asked.node, asked.spot.paint);
}

Expected<ObjectId> ContentCores::drawn(const Asked& asked) {
    const auto& [file, node, spot] = asked;
    if (node.has_text()) return drawn_.text(file, node.text(), spot.paint);
    if (node.has_particles()) return drawn_.particles(file, node.particles(), spot.paint);
    if (node.has_glyphs()) return drawn_.glyphs(file, node.glyphs(), spot.paint);
    if (node.has_volume()) return drawn_.volume(file, node.volume(), spot.paint);
    if (node.has_skin()) return drawn_.skin(file, node.skin(), spot.paint);
    if (!node.has_geometry()) return drawn_.surface(file, node, spot.paint);
    return node.has_lattice() ? drawn_.deformation(file, node, spot.paint)
                              : drawn_.geometry(file, node.geometry(), spot.paint);
}

Expected<ObjectId> ContentCores::inlined(const Asked& asked) {
    return makeInline(draft_, files_, asked.file, asked.node);
}

Expected<ObjectId> ContentCores::movie(const Asked& asked) {
    return movies_.movie(asked.file, asked.node.movie());
}

Expected<ObjectId> ContentCores::camera(const Asked& asked) {
    const proto::scene::Node& node = asked.node;
    Camera camera;
    if (node.camera().has_world_units_per_metre()) camera.worldUnitsPerMetre = node.camera().world_units_per_metre();
    if (!(camera.worldUnitsPerMetre > 1e-9 && camera.worldUnitsPerMetre < 1e12))
        return fail(ErrorCode::kBadInput, "a camera's world_units_per_metre must be above zero");
    camera.enabled = draft_.enablesCamera(asked.file, asked.spot.camerasEnabled, !node.camera().disabled());
    if (camera.enabled) draft_.scene().hasCamera = true;
    return draft_.create(camera);
}

Expected<ObjectId> ContentCores::choice(const Asked& asked) {
    const proto::scene::Node& node = asked.node;
    Switch choice;
    if (node.switch_().has_choice()) choice.choice = node.switch_().choice();
    if (choice.choice < Switch::kNone)
        return fail(ErrorCode::kBadInput,
                    "a switch's choice is a child's number from 0, -1 (all) or -2 (none); `shown` names several");
    if (node.switch_().shown_size() > 0 && node.switch_().has_choice())
        return fail(ErrorCode::kBadInput, "a switch has a choice, or says which are shown");
    for (const std::uint32_t child : node.switch_().shown()) {
        if (child > 62)
            return fail(ErrorCode::kBadInput,
                        fmt::format("a switch shows child {}: several can be chosen among the first 63", child));
        choice.choice = Switch::kMask;
        choice.mask |= std::int64_t{1} << child;
    }
    return draft_.create(choice);
}

Expected<ObjectId> ContentCores::materialGroup(const Asked& asked) {
    LoadedFile& file = asked.file;
    const proto::scene::Node& node = asked.node;
    Expected<MaterialGroup> group = readTableObject<MaterialGroup>(node.material_group());
    if (!group) return tl::unexpected(group.error());
    if (!node.material_group().material().empty()) {
        const Expected<ObjectId> material = materials_.material(file, node.material_group().material());
        if (!material) return material;
        group->material = *material;
    }
    return draft_.create(*group);
}

Expected<ObjectId> ContentCores::levels(const Asked& asked) {
    LoadedFile& file = asked.file;
    const proto::scene::Node& node = asked.node;
    const auto& message = node.distance_lod();
    Expected<DistanceLOD> lod = readTableObject<DistanceLOD>(message);
    if (!lod) return tl::unexpected(lod.error());
    lod->ranges =
        Blob::of(std::span<const double>(message.range().data(), static_cast<std::size_t>(message.range_size())));
    if (const Expected<void> sound = checkRanges(*lod); !sound) return tl::unexpected(sound.error());
    if (node.node_size() == 0)
        draft_.note(fmt::format("{}: a distance_lod without levels: nothing below it is shown until nodes hang there",
                                file.label));
    else if (node.node_size() <= message.range_size())
        draft_.note(
            fmt::format("{}: a distance_lod with {} ranges and {} below it: beyond the ranges that count the last of "
                        "these is shown",
                        file.label, message.range_size(), node.node_size()));
    return draft_.create(*lod);
}

Expected<ObjectId> ContentCores::billboard(const Asked& asked) {
    const proto::scene::Node& node = asked.node;
    if (node.billboard().point() && node.billboard().has_axis())
        return fail(ErrorCode::kBadInput, "a billboard has an axis or a point, not both");
    Expected<Billboard> billboard = readTableObject<Billboard>(node.billboard());
    if (!billboard) return tl::unexpected(billboard.error());
    if (node.billboard().point()) billboard->axis = Vec3d::Zero();
    return draft_.create(*billboard);
}

Expected<ObjectId> ContentCores::motion(const Asked& asked) {
    const proto::scene::Node& node = asked.node;
    const Expected<Blob> keys = readKeys(node.motion());
    if (!keys) return tl::unexpected(keys.error());
    Motion motion;
    motion.keys = *keys;
    motion.mode = node.motion().mode();
    if (!proto::scene::Motion::Mode_IsValid(node.motion().mode()))
        return fail(ErrorCode::kBadInput,
                    fmt::format("a motion's mode is {}, which is none of its words", motion.mode));
    motion.playing = !node.motion().paused();
    return draft_.create(motion);
}

Expected<ObjectId> ContentCores::animation(const Asked& asked) {
    const proto::scene::Node& node = asked.node;
    Expected<Animation> animation = readTableObject<Animation>(node.animation());
    if (!animation) return tl::unexpected(animation.error());
    if (node.animation().has_mode() && !proto::scene::Animation::Mode_IsValid(node.animation().mode()))
        return fail(ErrorCode::kBadInput, "an animation's mode is none of its words");
    if (node.animation().channel().empty()) return fail(ErrorCode::kBadInput, "an animation has no channels");
    animation->playing = !node.animation().paused();
    return draft_.create(*animation);
}

Expected<ObjectId> ContentCores::applicationData(const Asked& asked) {
    const proto::scene::Node& node = asked.node;
    Expected<ApplicationData> data = readTableObject<ApplicationData>(node.application_data());
    if (!data) return tl::unexpected(data.error());
    if (data->key.empty()) return fail(ErrorCode::kBadInput, "application_data without a key, which says what it is");
    const std::string& bytes = node.application_data().data();
    data->data = Blob::of(std::span<const char>(bytes.data(), bytes.size()));
    return draft_.create(*data);
}

Expected<ObjectId> ContentCores::surroundings(const Asked& asked) {
    LoadedFile& file = asked.file;
    const proto::scene::Node& node = asked.node;
    Expected<Environment> environment = readEnvironment(node.environment());
    if (!environment) return tl::unexpected(environment.error());
    if (!node.environment().image().empty()) {
        const Expected<ObjectId> image = materials_.image(file, node.environment().image());
        if (!image) return image;
        const proto::scene::Image& said = *file.images.at(node.environment().image());
        if (said.shape() == proto::scene::Image::LINE || said.shape() == proto::scene::Image::SOLID)
            return fail(ErrorCode::kBadInput, fmt::format("the surroundings' image '{}' is neither flat nor a cube",
                                                          node.environment().image()));
        if (said.shape() == proto::scene::Image::FLAT &&
            std::abs(static_cast<double>(said.width_px()) - 2.0 * said.height_px()) > said.height_px() / 8.0)
            return fail(ErrorCode::kBadInput,
                        fmt::format("the surroundings' image '{}' of {} × {} pixels is not about twice "
                                    "as wide as high",
                                    node.environment().image(), said.width_px(), said.height_px()));
        environment->image = *image;
    }
    return draft_.create(*environment);
}

Expected<ObjectId> ContentCores::interest(const Asked& asked) {
    const proto::scene::Node& node = asked.node;
    const Expected<Interest> interest = readInterest(node.interest());
    if (!interest) return tl::unexpected(interest.error());
    return draft_.create(*interest);
}

Expected<ObjectId> ContentCores::collisionObject(const Asked& asked) {
    const proto::scene::Node& node = asked.node;
    const Expected<CollisionObject> object = readCollisionObject(node.collision_object());
    if (!object) return tl::unexpected(object.error());
    return draft_.create(*object);
}

}  // namespace tessera
