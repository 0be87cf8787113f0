/// Notices as nodes of the scene: what ProgramNotices.h draws, read and written.
#pragma once

#include <optional>
#include <vector>

#include "common/change/ChangeList.h"
#include "common/drawable/Drawable.h"
#include "common/scene/Aspect.h"
#include "server/programs/NoticeText.h"

namespace tessera {

/// A notice as it should be seen.
struct WantedNotice {
    NoticeText words;
    Vec3d at;
    double em = 1;
    Box of;              ///< the thing, in the world
    bool close = false;  ///< before the eye, wherever the thing is
    [[nodiscard]] Vec3d plateSize() const;
    /// Of the first baseline, so that all lines lie about the origin: letters reach about 0.75 em up and 0.25 em down.
    [[nodiscard]] double firstLine() const;
};

/// The objects of a notice as they stand in the scene.
struct PresentNotice {
    ObjectId place, plate, lines, text;  ///< three Transforms and a Text
};

/// The sheet behind the letters of all notices, 1 wide and high.
[[nodiscard]] const MeshArrays& noticePlate();

/// All below `top`; nothing where anything else stands among them.
[[nodiscard]] std::optional<std::vector<PresentNotice>> readNotices(const Aspect& scene, const Node& top);
/// What others have hung among them.
[[nodiscard]] std::vector<ObjectId> othersBelow(const Aspect& scene, const Node& top);
/// Makes of a notice that stands the wanted one. Only what differs goes into the list.
void setNotice(const Aspect& scene, ChangeListBuilder& list, const PresentNotice& now, const WantedNotice& wanted);
/// New ones, with a top of their own.
void buildNotices(const Aspect& scene, ChangeListBuilder& list, const std::vector<WantedNotice>& wanted);
/// Whether nothing stands behind their top but contacts, which want to be the last.
[[nodiscard]] bool noticesAreLast(const Aspect& scene, ObjectId top);

}  // namespace tessera
