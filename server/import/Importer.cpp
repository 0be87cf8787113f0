#include "server/import/Importer.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "common/drawable/SceneBounds.h"
#include "server/import/SceneAssembly.h"

namespace tessera {
namespace {

/// Rewrites the Transform of `Placing::fit`: only now is known how large it all is.
Expected<void> fitIn(ImportedScene& scene, ObjectId parent, const Placing& placing) {
    // The list as it would be alone in the world: the parent's place and size are not the file's.
    ChangeList alone = scene.list;
    for (Placement& placement : alone.placements)
        if (placement.parent == parent) placement.parent = kRootNode;
    replaceIds(alone, [](ObjectId id) {
        return isPlaceholder(id) ? ObjectId{id.value - kFirstPlaceholder + kRootNode.value + 1} : id;
    });
    Aspect aspect;
    if (const Expected<void> applied = aspect.apply(alone); !applied) return tl::unexpected(applied.error());
    const Box box = sceneBounds(aspect);
    const double longest = box.empty() ? 0 : box.size().maxCoeff();
    if (!(longest > 0) || !std::isfinite(longest))
        return fail(ErrorCode::kBadInput, "what has no size, or none that is finite, cannot be given one");
    const double factor = *placing.fit / longest;
    if (!(factor >= 1 / kMaxPlacingScale && factor <= kMaxPlacingScale))
        return fail(
            ErrorCode::kBadInput,
            fmt::format(
                "a size of {:g}: it is {:g} units long, and would have to be scaled by {:g}; possible is {:g} to {:g}",
                *placing.fit, longest, factor, 1 / kMaxPlacingScale, kMaxPlacingScale));
    const Vec3d underside(box.center().x(), box.lower.y(), box.center().z());
    const Vec3d at = placing.at.value_or(Vec3d::Zero()) - factor * underside;
    // Lists say nothing of what is as it is by default: there may be no row, and no column.
    const auto rewrite = [&](FieldId field, const Vec3d& value) {
        const auto before = [&](const FieldColumn& column) {
            return std::pair(column.type, column.field) < std::pair(Transform::kType, field);
        };
        const auto place = std::ranges::partition_point(scene.list.columns, before);
        const bool isThere =
            place != scene.list.columns.end() && place->type == Transform::kType && place->field == field;
        FieldColumn& column = isThere ? *place
                                      : *scene.list.columns.insert(place, FieldColumn::ofShape(Transform::kType, field,
                                                                                               FieldKind::kDouble, 3));
        const Doubles numbers{{value.x(), value.y(), value.z()}, 3};
        if (const auto row = std::ranges::find(column.ids, scene.place); row != column.ids.end())
            column.assign(static_cast<std::size_t>(row - column.ids.begin()), numbers);
        else
            column.append(scene.place, numbers);
    };
    rewrite(fieldId<&Transform::translation>, at);
    rewrite(fieldId<&Transform::scale>, Vec3d::Constant(factor));
    return {};
}

}  // namespace

Expected<ImportedScene> importScene(const std::string& path, ObjectId parent, const ImportOptions& options) {
    return importScenes(std::span(&path, 1), parent, options);
}

Expected<ImportedScene> importScenes(std::span<const std::string> paths, ObjectId parent,
                                     const ImportOptions& options) {
    if (options.placing)
        if (const Expected<void> sound = checkPlacing(*options.placing); !sound) return tl::unexpected(sound.error());
    SceneAssembly assembly(options);
    for (const std::string& path : paths)
        if (Expected<void> added = assembly.add(path, parent); !added) return tl::unexpected(added.error());
    Expected<ImportedScene> taken = assembly.take();
    if (!taken) return taken;
    ImportedScene scene = std::move(*taken);
    if (options.placing && options.placing->fit)
        if (const Expected<void> fitted = fitIn(scene, parent, *options.placing); !fitted)
            return failWith(paths.front(), fitted.error());
    return scene;
}

}  // namespace tessera
