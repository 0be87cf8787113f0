#include "common/codec/NavigationMessage.h"

#include <fmt/format.h>

namespace tessera {

void putNavigation(const Navigation& from, proto::Wall::Navigation& to) {
    to.set_mode(static_cast<proto::Wall::NavigationMode>(from.mode));
    to.set_speed_m_s(from.speed);
    to.set_faster(from.fasterFactor);
    to.set_turn_deg_s(from.turnDegrees);
    to.set_body_radius_m(from.bodyRadius);
    to.set_step_m(from.step);
    to.set_steepest_deg(from.steepestDegrees);
}

Expected<Navigation> readNavigation(const proto::Wall::Navigation& from) {
    // Enumerations are open in proto3: a number may stand for nothing.
    if (!proto::Wall::NavigationMode_IsValid(from.mode()))
        return fail(ErrorCode::kBadInput, fmt::format("navigation: mode cannot be {}: FLY, ORBIT and WALK are known",
                                                      static_cast<int>(from.mode())));
    Navigation to;
    to.mode = static_cast<NavigationMode>(from.mode());
    if (from.has_speed_m_s()) to.speed = from.speed_m_s();
    if (from.has_faster()) to.fasterFactor = from.faster();
    if (from.has_turn_deg_s()) to.turnDegrees = from.turn_deg_s();
    if (from.has_body_radius_m()) to.bodyRadius = from.body_radius_m();
    if (from.has_step_m()) to.step = from.step_m();
    if (from.has_steepest_deg()) to.steepestDegrees = from.steepest_deg();
    return to;
}

}  // namespace tessera
