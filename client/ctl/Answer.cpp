#include "client/ctl/Answer.h"

#include <fmt/format.h>

namespace tessera {

nlohmann::ordered_json jsonOf(const Vec3d& v) {
    return nlohmann::ordered_json::array({v.x(), v.y(), v.z()});
}

std::string textOf(const Vec3d& v) {
    return fmt::format("({:.6g}, {:.6g}, {:.6g})", v.x(), v.y(), v.z());
}

std::string nameOf(const Aspect& scene, ObjectId id) {
    return scene.get<Node>(id) ? pathOf(scene, id) : fmt::format("#{}", id.value);
}

std::string jsonLine(const nlohmann::ordered_json& json) {
    return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace tessera
