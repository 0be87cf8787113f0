#include "common/codec/ApplicationSceneHeads.h"

#include "common/codec/ApplicationUnpacker.h"
#include "proto/application.pb.h"

namespace tessera {

namespace {

void setVector(proto::application::Vector& to, const Vec3d& from) {
    to.set_x(from.x());
    to.set_y(from.y());
    to.set_z(from.z());
}

void setRotation(proto::application::Rotation& to, const Quatd& from) {
    to.set_w(from.w());
    to.set_x(from.x());
    to.set_y(from.y());
    to.set_z(from.z());
}

}  // namespace

void putClone(proto::application::Clone& to, const request::CloneNode& from) {
    to.set_node(from.node.value);
    to.set_under(from.under.value);
    to.set_name(from.name);
    to.set_deep(from.deep);
    for (const ObjectType type : from.shareTypes) to.add_share_types(type.value);
    for (const ObjectId id : from.shareObjects) to.add_share_objects(id.value);
}

request::CloneNode readClone(const proto::application::Clone& from, ApplicationUnpacker& in) {
    request::CloneNode out{.node = ObjectId{from.node()},
                           .under = ObjectId{from.under()},
                           .name = in.text(from.name()),
                           .deep = from.deep()};
    const auto all = static_cast<std::size_t>(from.share_types_size()) + static_cast<std::size_t>(from.share_objects_size());
    if (!in.within(all, in.limits().maxShared, "types and objects to share")) return out;
    for (const std::uint32_t type : from.share_types()) out.shareTypes.push_back(in.objectType(type));
    for (const std::uint64_t id : from.share_objects()) out.shareObjects.emplace_back(id);
    return out;
}

void putFind(proto::application::Find& to, const request::FindNodes& from) {
    to.set_expression(from.expression);
    to.set_node(from.node.value);
    to.set_core_type(from.coreType.value);
    to.set_page_size(from.pageSize);
}

request::FindNodes readFind(const proto::application::Find& from, ApplicationUnpacker& in) {
    in.expectParts(1);
    return {.expression = in.text(from.expression()),
            .node = ObjectId{from.node()},
            .coreType = in.objectType(from.core_type()),
            .pageSize = from.page_size(),
            .after = in.records<ObjectId>(0, in.limits().maxDepth)};
}

void putGetTree(proto::application::GetTree& to, const request::GetTree& from) {
    to.set_node(from.node.value);
    to.set_levels(from.levels);
    to.set_core_type(from.coreType.value);
}

request::GetTree readGetTree(const proto::application::GetTree& from, ApplicationUnpacker& in) {
    in.expectParts(2);
    request::GetTree out;
    out.node = ObjectId{from.node()};
    out.levels = from.levels();
    out.after = in.records<ObjectId>(0, in.limits().maxDepth);
    out.coreType = in.objectType(from.core_type());
    out.cores = in.records<ObjectId>(1, in.limits().maxFilterCores);
    return out;
}

void putLoad(proto::application::Load& to, const request::LoadFile& from) {
    to.set_path(from.path);
    to.set_parent(from.parent.value);
    if (from.placing.at) setVector(*to.mutable_at(), *from.placing.at);
    if (from.placing.scale) to.set_scale(*from.placing.scale);
    if (from.placing.fit) to.set_fit(*from.placing.fit);
    to.set_up(static_cast<std::uint32_t>(from.placing.up));
    if (from.placing.pointRadius) to.set_point_radius(*from.placing.pointRadius);
}

request::LoadFile readLoad(const proto::application::Load& from, ApplicationUnpacker& in) {
    request::LoadFile load{in.text(from.path()), ObjectId{from.parent()}};
    if (from.has_at()) load.placing.at = in.vector(from.at());
    if (from.has_scale()) load.placing.scale = in.finite(from.scale());
    if (from.has_fit()) load.placing.fit = in.finite(from.fit());
    if (from.up() > static_cast<std::uint32_t>(UpAxis::kZ)) in.refuse(ErrorCode::kBadInput, "an axis that is none");
    load.placing.up = static_cast<UpAxis>(from.up());
    if (from.has_point_radius()) load.placing.pointRadius = in.finite(from.point_radius());
    return load;
}

void putMove(proto::application::Move& to, const request::MoveNode& from) {
    to.set_node(from.node.value);
    if (from.move.translation) setVector(*to.mutable_translation(), *from.move.translation);
    if (from.move.rotation) setRotation(*to.mutable_rotation(), *from.move.rotation);
    if (from.move.scale) setVector(*to.mutable_scale(), *from.move.scale);
    to.set_relative(from.move.relative);
    to.set_gesture(from.gesture);
}

request::MoveNode readMove(const proto::application::Move& from, ApplicationUnpacker& in) {
    request::MoveNode out{
        .node = ObjectId{from.node()}, .move = {.relative = from.relative()}, .gesture = from.gesture()};
    if (from.has_translation()) out.move.translation = in.vector(from.translation());
    if (from.has_rotation()) out.move.rotation = in.rotation(from.rotation());
    if (from.has_scale()) out.move.scale = in.vector(from.scale());
    return out;
}

void putPicked(proto::application::Picked& to, const answer::Picked& from) {
    to.set_hit(from.hit);
    to.set_node(from.node.value);
    to.set_face(from.face);
    setVector(*to.mutable_point(), from.point);
    to.set_x_px(from.xPx);
    to.set_y_px(from.yPx);
    to.set_t(from.t);
    setVector(*to.mutable_normal(), from.normal);
    to.set_second(from.corners.x());
    to.set_third(from.corners.y());
    if (!from.texcoord) return;
    to.set_has_texcoord(true);
    to.set_texcoord_u(from.texcoord->x());
    to.set_texcoord_v(from.texcoord->y());
}

answer::Picked readPicked(const proto::application::Picked& from, ApplicationUnpacker& in) {
    answer::Picked out{from.hit(), ObjectId{from.node()}, from.face(), in.vector(from.point()), in.finite(from.x_px()), in.finite(from.y_px())};
    out.t = in.finite(from.t());
    out.normal = in.vector(from.normal());
    out.corners = {in.finite(from.second()), in.finite(from.third())};
    if (from.has_texcoord()) out.texcoord = Vec2d(in.finite(from.texcoord_u()), in.finite(from.texcoord_v()));
    return out;
}

}  // namespace tessera
