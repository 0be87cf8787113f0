/// The scenes that come with Tessera, as they are before anything moves.
#pragma once

#include <string>

#include "common/cores/Animation.h"
#include "common/cores/Camera.h"
#include "common/cores/SurfaceParts.h"
#include "common/scene/Action.h"
#include "common/scene/Aspect.h"
#include "common/wall/View.h"
#include "server/import/Importer.h"
#include "tests/unit/motion/Bodies.h"

namespace tessera::test {

/// Of Debian's package assimp-testmodels.
inline constexpr const char* kAssimpModels = "/usr/share/assimp/models";
[[nodiscard]] inline std::string plantFolder() {
    return (bodies::dataFolder() / "plant").string();
}

/// `name`: as its file in deploy/scenes, without the end.
[[nodiscard]] inline Expected<Aspect> loadShipped(const std::string& name) {
    ImportOptions options;
    options.assetFolders = {kAssimpModels, plantFolder()};
    options.importerProgram = TESSERA_BIN_DIR "/tessera-import";
    // Whether the system can confine a reader is tested elsewhere.
    options.allowUnconfined = true;
    auto scene = importScene(TESSERA_SOURCE_DIR "/deploy/scenes/" + name + ".tsct", kRootNode, options);
    if (!scene) return tl::unexpected(scene.error());
    replaceIds(scene->list,
               [](ObjectId id) { return isPlaceholder(id) ? ObjectId{id.value - kFirstPlaceholder + 2} : id; });
    Aspect aspect;
    if (auto applied = aspect.apply(scene->list); !applied) return tl::unexpected(applied.error());
    // No server has tried persons' programs: here they are drawn all the same, and what GL refuses as what is wrong.
    ChangeListBuilder tried;
    for (const ObjectId id : aspect.ids())
        if (aspect.get<SurfaceProgram>(id))
            tried.set(id, typeOf<SurfaceProgram>(), fieldId<&SurfaceProgram::verdict>, SurfaceProgram::kGood);
    if (auto applied = tried.empty() ? Expected<void>() : aspect.apply(tried.take()); !applied)
        return tl::unexpected(applied.error());
    return aspect;
}

/// 3.2 m by 1.8 m, as the shipped walls are.
[[nodiscard]] inline Screen flatScreen(int columns, int rows, int tileWidthPx, int tileHeightPx) {
    Screen screen;
    screen.lowerLeft = {-1.6, 0.6, 0};
    screen.lowerRight = {1.6, 0.6, 0};
    screen.upperLeft = {-1.6, 2.4, 0};
    screen.grid = {.columns = columns, .rows = rows, .tileWidthPx = tileWidthPx, .tileHeightPx = tileHeightPx};
    return screen;
}

/// From its last camera that is on.
[[nodiscard]] inline View cameraOfScene(const Aspect& aspect) {
    View view;
    Action search;
    search.on<Camera>([&](const Visit& visit, const Camera& camera) {
        if (camera.enabled != 0) {
            view.position = visit.world_T_node.translation();
            view.orientation = Quatd(visit.world_T_node.rotation());
            view.worldUnitsPerMetre = camera.worldUnitsPerMetre;
        }
        return Descend::kInto;
    });
    search.run(aspect);
    return view;
}

/// Where the tour stands in a room of the gallery: the values of its key frames come in pairs, coming and going.
[[nodiscard]] inline View viewOfRoom(const Aspect& scene, std::size_t room) {
    View view = cameraOfScene(scene);
    for (const ObjectId id : scene.ids()) {
        const auto* frames = scene.get<KeyFrames>(id);
        const auto tour = findNode(scene, "/tour");
        if (!frames || !tour || frames->target != scene.get<Node>(*tour)->core) continue;
        const std::span<const double> places = frames->values.as<double>();
        if (6 * room + 2 < places.size())
            view.position = {places[6 * room], places[6 * room + 1], places[6 * room + 2]};
    }
    return view;
}

}  // namespace tessera::test
