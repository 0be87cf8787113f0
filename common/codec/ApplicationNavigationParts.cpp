#include "common/codec/ApplicationNavigationParts.h"

#include <fmt/format.h>

#include "common/codec/ApplicationUnpacker.h"
#include "proto/application.pb.h"

namespace tessera {

void putNavigate(proto::application::Navigate& to, const request::NavigateView& from) {
    if (from.mode) to.set_mode(static_cast<std::uint32_t>(*from.mode));
    to.set_deed(static_cast<std::uint32_t>(from.deed));
    to.set_node(from.node.value);
    to.set_bookmark(from.bookmark);
}

request::NavigateView readNavigate(const proto::application::Navigate& from, ApplicationUnpacker& in) {
    using Deed = request::NavigateView::Deed;
    in.expectParts(1);
    request::NavigateView out;
    if (from.has_mode()) out.mode = in.enumeration(from.mode(), kLastNavigationMode);
    out.deed = in.enumeration(from.deed(), Deed::kKeepBookmark);
    out.node = ObjectId{from.node()};
    out.bookmark = from.bookmark();
    const bool needsNumber = out.deed == Deed::kGoToBookmark || out.deed == Deed::kKeepBookmark;
    if (needsNumber && (out.bookmark < 1 || out.bookmark > kBookmarks))
        in.refuse(ErrorCode::kBadInput, fmt::format("there is no bookmark {}: 1 to {} are possible", out.bookmark, kBookmarks));
    const std::vector<InputState> states = in.records<InputState>(0, 1);
    if (!states.empty()) out.input = states.front();
    return out;
}

void putManipulate(proto::application::Manipulate& to, const request::Manipulate& from) {
    const auto putVector = [](proto::application::Vector& out, const Vec3d& v) {
        out.set_x(v.x());
        out.set_y(v.y());
        out.set_z(v.z());
    };
    to.set_deed(static_cast<std::uint32_t>(from.deed));
    to.mutable_aim()->set_x_px(from.aim.xPx);
    to.mutable_aim()->set_y_px(from.aim.yPx);
    to.mutable_aim()->set_wand(from.aim.wand);
    if (!from.ray) return;
    putVector(*to.mutable_origin(), from.ray->origin);
    putVector(*to.mutable_direction(), from.ray->direction);
}

request::Manipulate readManipulate(const proto::application::Manipulate& from, ApplicationUnpacker& in) {
    using Deed = request::Manipulate::Deed;
    request::Manipulate out;
    out.deed = in.enumeration(from.deed(), Deed::kRelease);
    out.aim = {in.finite(from.aim().x_px()), in.finite(from.aim().y_px()), in.text(from.aim().wand())};
    if (from.has_origin() || from.has_direction()) out.ray = Ray{in.vector(from.origin()), in.vector(from.direction())};
    return out;
}

}  // namespace tessera
