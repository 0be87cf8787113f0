#include "server/sim/view/HandleSizes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/cores/Manipulator.h"
#include "common/scene/FieldTable.h"

namespace tessera {
namespace {

constexpr double kStepsPerOctave = 128;

}  // namespace

HandleSizes::HandleSizes(const Wall& wall, ManipulatorDrags& drags)
    : drags_(drags),
      lookers_(wall),
      sights_(lookers_.bytes().size() > 1 ? std::min(wall.users.size(), kLevelUsers) : 1) {}

/// 0: nobody can say.
double HandleSizes::sizeFor(std::size_t byte, const Vec3d& at, double pixels) const {
    double least = std::numeric_limits<double>::infinity();
    for (const std::size_t user : lookers_.usersOf(lookers_.byteFor(byte))) {
        const Lookers::Looker& looker = lookers_[user];
        least = std::min(least, pixels * (at - looker.head).norm() / looker.pixels);
    }
    if (!std::isfinite(least)) return 0;
    return std::exp2(std::round(kStepsPerOctave * std::log2(std::clamp(least, 1e-30, 1e29))) / kStepsPerOctave);
}

ChangeList HandleSizes::choose(const Aspect& scene, ManipulatorDisplay& display, const View& view) {
    if (display.bearers().empty() || lookers_.bytes().empty()) return {};
    if (lookers_.lookFrom(view)) {
        stale_ = true;
        std::vector<Vec3d> heads;
        for (std::size_t i = 0; i < sights_; ++i)
            heads.push_back(lookers_[lookers_.usersOf(lookers_.byteFor(i)).front()].head);
        drags_.headsAre(std::move(heads));
    }
    if (!stale_) return {};
    ChangeListBuilder list;
    for (const auto& [node, core] : display.bearers()) {
        const Manipulator& manipulator = *scene.get<Manipulator>(core);
        std::array<Vec4f, 2> sizes{Vec4f::Zero(), Vec4f::Zero()};
        if (manipulator.pixels > 0) {
            const std::optional<Vec3d> origin = display.originOf(scene, node);
            if (!origin) continue;
            bool known = true;
            for (std::size_t i = 0; i < sights_; ++i) {
                const auto size = static_cast<float>(sizeFor(i, *origin, manipulator.pixels));
                known = known && size > 0;
                sizes[i / 4][static_cast<Eigen::Index>(i % 4)] = size;
            }
            if (!known) continue;
        }
        if (sizes[0] != manipulator.sizes) setField<&Manipulator::sizes>(list, core, sizes[0]);
        if (sizes[1] != manipulator.moreSizes) setField<&Manipulator::moreSizes>(list, core, sizes[1]);
    }
    ChangeList said = list.take();
    stale_ = !said.empty();  // looked at once more: it may be refused
    return said;
}

}  // namespace tessera
