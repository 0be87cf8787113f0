#include "tests/bench/FileStage.h"

#include <cmath>

#include "common/cores/Camera.h"
#include "common/scene/Action.h"
#include "server/import/Importer.h"

namespace tessera::bench {

Stage fileStage(const std::string& name, const std::string& path, const std::vector<std::string>& assets, int frames) {
    const ImportedScene imported = orExit(importScene(
        path, kRootNode,
        {.assetFolders = assets, .allowUnconfined = true, .importerProgram = TESSERA_BIN_DIR "/tessera-import"}));
    ChangeList list = imported.list;
    replaceIds(list, [](ObjectId id) { return isPlaceholder(id) ? ObjectId{id.value - kFirstPlaceholder + 2} : id; });
    Stage stage;
    stage.name = name;
    static_cast<void>(orExit(stage.aspect.apply(list).map([] { return 0; })));
    View first;
    bool found = false;
    Action search;
    search.on<Camera>([&](const Visit& visit, const Camera& camera) {
        if (!found && camera.enabled != 0) {
            found = true;
            first.position = visit.world_T_node.translation();
            first.orientation = Quatd(visit.world_T_node.rotation());
            first.worldUnitsPerMetre = camera.worldUnitsPerMetre;
        }
        return Descend::kInto;
    });
    search.run(stage.aspect);
    if (!found) {
        std::fprintf(stderr, "%s has no camera\n", path.c_str());
        std::exit(3);
    }
    for (int i = 0; i < frames; ++i) {
        View view = first;
        const double angle = 0.8 * std::sin(6.28 * i / frames);
        view.orientation = first.orientation * Quatd(Eigen::AngleAxisd(angle, Vec3d::UnitY()));
        stage.views.push_back(view);
    }
    return stage;
}

}  // namespace tessera::bench
