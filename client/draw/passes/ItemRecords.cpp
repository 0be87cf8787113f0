#include "client/draw/passes/ItemRecords.h"

#include <limits>

#include "client/draw/store/DrawForms.h"
#include "common/math/Decompositions.h"

namespace tessera {
namespace {

/// The inverse transpose of what makes an ellipsoid of a ball of radius 1. One that is nearly flat is made a little
/// thicker: of what is flatter single precision knows nothing.
Mat3d roundOf(const Mat3d& linear, double radius) {
    constexpr double kThinnest = 1.0 / 256;
    const SingularValues parts = singularValuesOf(radius * linear);
    const Vec3d& lengths = parts.values;
    const double least = std::max(kThinnest * lengths[0], std::numeric_limits<double>::min());
    return parts.u * lengths.cwiseMax(least).cwiseInverse().asDiagonal() * parts.v.transpose();
}

}  // namespace

void RecordMaker::make(std::span<const DrawItem* const> items, const ScreenCamera& camera,
                       std::vector<ItemRecord>& records) {
    records.resize(items.size());
    world_T_items_.clear();
    rows_.clear();
    for (std::size_t i = 0; i < items.size(); ++i) {
        world_T_items_.push_back(items[i]->world_T_item.data());
        rows_.push_back(records[i].eye_T_item.front().data());
    }
    placeBeforeEye(camera.eye_T_world, world_T_items_, rows_);
    for (std::size_t i = 0; i < items.size(); ++i) {
        const DrawItem& item = *items[i];
        ItemRecord& record = records[i];
        record.node = {static_cast<std::uint32_t>(item.node.value), static_cast<std::uint32_t>(item.node.value >> 32)};
        const DrawForm& form = formOf(item.kind);
        record.size = {};
        if (!form.size) continue;
        const Mat3d eye_R_item = (camera.eye_T_world * item.world_T_item).linear();
        record.size = form.size(item, eye_R_item);
        if (!form.balls || !isStretched(item.world_T_item.linear())) continue;
        const Mat3d round = roundOf(eye_R_item, item.pointRadius);
        for (int r = 0; r < 3; ++r)
            for (int c = 0; c < 3; ++c)
                record.normalRows[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)] =
                    static_cast<float>(round(r, c));
    }
}

}  // namespace tessera
