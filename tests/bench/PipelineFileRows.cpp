/// The shipped scenes in which free bodies pour into the plant, beside Bullet's dynamics world with the same hulls,
/// masses and triangles: milliseconds per frame, in turns frame by frame.
///
/// Bullet is told lengths and gravity ten times as large, because its bodies are to be of 0.05 to 10 units; then its
/// own margin is what its users have. What the two simulate is not the same to the last digit: the heaps differ.
#include <fmt/format.h>

#include <array>
#include <map>

#include "common/scene/FieldTable.h"
#include "server/collision/objects/ObjectHandler.h"
#include "server/import/Importer.h"
#include "tests/bench/PipelineBullet.h"
#include "tests/bench/PipelineRows.h"
#include "tests/bench/PipelineScene.h"

namespace tessera {

namespace {

constexpr double kSeconds = 1.0 / 60, kBulletUnits = 10;

Expected<ChangeList> readScene(const std::string& file, const std::string& assets) {
    ImportOptions options;
    options.importerProgram = TESSERA_BIN_DIR "/tessera-import";
    options.allowUnconfined = true;
    options.assetFolders = {assets};
    Expected<ImportedScene> imported = importScene(file, kRootNode, options);
    if (!imported) return tl::unexpected(imported.error());
    replaceIds(imported->list, [](ObjectId id) {
        return isPlaceholder(id) ? ObjectId{id.value - kFirstPlaceholder + kRootNode.value + 1} : id;
    });
    return std::move(imported->list);
}

/// What the pipeline's own object handler says takes part: free bodies by their hulls, all else by its triangles.
std::size_t fill(BulletDynamics& bullet, const Aspect& aspect) {
    ObjectHandler handler(std::make_shared<ShapeCache>());
    handler.update(aspect, nullptr);
    std::map<std::pair<const CollisionShape*, double>, std::uint32_t> hulls;
    std::size_t bodies = 0;
    for (const Part& part : handler.parts()) {
        if (!part.solid()) continue;
        const Body& body = handler.bodies()[part.body];
        const double scale = kBulletUnits * part.world.linear().col(0).norm();
        MeshArrays3 arrays;
        const auto append = [&](const Vec3d& p) {
            arrays.positions.insert(arrays.positions.end(), {p.x(), p.y(), p.z()});
        };
        if (!body.free()) {
            const TriangleMesh& mesh = part.shape->mesh();
            for (const Vec3d& p : mesh.positions()) append(kBulletUnits * (part.world * p));
            arrays.indices.assign(mesh.indices().begin(), mesh.indices().end());
            bullet.addGround(arrays);
            continue;
        }
        const auto [known, isNew] = hulls.try_emplace({part.shape.get(), scale}, 0);
        if (isNew) {
            for (const Vec3d& p : part.shape->hull()->vertices()) append(scale * p);
            known->second = bullet.addHull(arrays);
        }
        const Quatd rotation(Mat3d(part.world.linear() / part.world.linear().col(0).norm()));
        bullet.addBody(known->second, {kBulletUnits * part.world.translation(), rotation, Vec3d::Ones()}, body.mass,
                       kBulletUnits * body.velocity);
        ++bodies;
    }
    return bodies;
}

}  // namespace

void fileRows(const std::string& name, const PipelineOptions& options, CollisionTable& table) {
    const Expected<ChangeList> list =
        readScene(fmt::format(TESSERA_SOURCE_DIR "/deploy/scenes/{}.tsct", name), options.plant);
    if (!list) {
        fmt::print("\n{}: left out: {}\n", name, list.error().message);
        return;
    }
    PipelineScene scene;
    scene.open(*list);
    Vec3d gravity = Vec3d::Zero();
    {
        ObjectHandler handler(std::make_shared<ShapeCache>());
        handler.update(scene.aspect(), nullptr);
        gravity = kBulletUnits * handler.gravity();
    }
    BulletDynamics usual(gravity), bare(gravity, 0);
    const std::size_t bodies = fill(usual, scene.aspect());
    (void)fill(bare, scene.aspect());
    struct Stage {
        const char* name;
        int end;
        std::vector<double> ours, whole, theirs, without;
    };
    std::array<Stage, 3> stages{
        {{.name = "they fall", .end = 60}, {.name = "and land", .end = 120}, {.name = "and come to rest", .end = 300}}};
    for (Stage& stage : stages) stage.end /= options.quick ? 20 : bodies > 2'000 ? 2 : 1;
    const FrameClock clock(Clock::kThread);
    int frame = 0;
    for (Stage& stage : stages) {
        const int from = frame + 1;
        for (; frame < stage.end; ++frame) {
            const FrameTimes taken = scene.frame({}, clock);
            stage.ours.push_back(taken.asked);
            stage.whole.push_back(taken.whole);
            stage.theirs.push_back(clock.seconds([&] { usual.step(kSeconds); }));
            stage.without.push_back(clock.seconds([&] { bare.step(kSeconds); }));
        }
        const StepCounters& c = scene.result().counters;
        const auto add = [&](const char* what, const std::vector<double>& ours, const char* peer,
                             const std::vector<double>& theirs, const std::string& remark) {
            table.add({.pair = fmt::format("{}: {} free bodies", name, bodies),
                       .operation = fmt::format("{} ({} to {}){}", stage.name, from, stage.end, what),
                       .peer = peer,
                       .ours = summarise(ours),
                       .theirs = summarise(theirs),
                       .remark = remark});
        };
        add(", step", stage.ours, "Bullet, dynamics", stage.theirs,
            fmt::format("{} neighbours, {} asleep; Bullet: {} manifolds, {} asleep", c.neighbours, c.asleep,
                        usual.manifolds(), usual.asleep()));
        add(", step", stage.ours, "Bullet without margin", stage.without,
            fmt::format("{} manifolds, {} asleep", bare.manifolds(), bare.asleep()));
        add(", with commit", stage.whole, "Bullet, dynamics", stage.theirs, "");
    }
}

}  // namespace tessera
