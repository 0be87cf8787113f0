/// Poses of Transforms as the fields of change lists.
#pragma once

#include "common/change/ChangeList.h"
#include "common/math/Pose.h"
#include "common/scene/Aspect.h"

namespace tessera {

[[nodiscard]] bool isPoseField(const FieldColumn& column);
[[nodiscard]] Pose poseOf(const Transform& t);
/// Writes the part of a pose that a row of such a column says.
void setPart(Pose& pose, const FieldColumn& column, std::size_t row);
/// The columns that lead a Transform from one pose to another; nothing for fields that stay.
void addPose(ChangeListBuilder& builder, ObjectId id, const Pose& from, const Pose& to);
/// Adds rows to a list's column of the same field, or the column, in its place, where there is none. No object may be
/// in both.
void mergeColumn(ChangeList& list, FieldColumn column);
/// Whether an inverse says of the scene what is so already. Costs a look-up per row, up to the first that differs.
[[nodiscard]] bool saysNothing(const Aspect& scene, const ChangeList& inverse);

}  // namespace tessera
