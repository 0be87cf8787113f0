#include <fmt/format.h>
#include <time.h>

#include <random>

#include "client/draw/passes/DrawCalls.h"
#include "common/cores/Material.h"
#include "common/cores/Transform.h"
#include "common/scene/FieldTable.h"
#include "tests/bench/DrawingRows.h"
#include "tests/bench/DrawingStage.h"
#include "tests/bench/SilentSurface.h"

namespace tessera::bench {
namespace {

double threadUs() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return 1e6 * static_cast<double>(t.tv_sec) + 1e-3 * static_cast<double>(t.tv_nsec);
}

/// Things in a square around the eye, of which the tile sees about a tenth: so many cores, each of a material of its
/// own. Node, transform and core each, as files have them.
Aspect crowd(int count, int materials, ObjectId& oneMaterial) {
    std::mt19937 random(7);
    const double side = 4 * std::sqrt(static_cast<double>(count));
    std::uniform_real_distribution<double> place(-0.5 * side, 0.5 * side), up(1.5, 4.5);
    ChangeListBuilder list;
    std::uint64_t next = 2;
    std::vector<ObjectId> cores;
    for (int m = 0; m < materials; ++m) {
        Material material;
        material.baseColor = Vec4f(0.5f, 0.2f, static_cast<float>(m) / static_cast<float>(materials), 1);
        material.roughness = 0.2f + 0.6f * static_cast<float>(m % 7) / 7;
        const ObjectId id{next++};
        list.create(id, typeOf<Material>());
        setAllFields(list, id, Object::of(material));
        oneMaterial = id;
        const MeshData mesh = m % 2 ? makeBox({1, 1 + 0.1 * (m % 8), 1}) : makeSphere(0.5, 6 + m % 8);
        const MeshArrays arrays = mesh.toArrays();
        const ObjectId core{next++};
        list.create(core, typeOf<Geometry>());
        setField<&Geometry::positions>(list, core, arrays.positions);
        setField<&Geometry::normals>(list, core, arrays.normals);
        setField<&Geometry::indices>(list, core, arrays.indices);
        setField<&Geometry::material>(list, core, id);
        cores.push_back(core);
    }
    for (int i = 0; i < count; ++i) {
        const ObjectId at{next++}, outer{next++}, inner{next++};
        list.create(at, typeOf<Transform>());
        setField<&Transform::translation>(list, at, Vec3d(place(random), up(random), place(random)));
        list.create(outer, typeOf<Node>());
        setField<&Node::core>(list, outer, at);
        list.place(outer, kRootNode);
        list.create(inner, typeOf<Node>());
        setField<&Node::core>(list, inner, cores[random() % cores.size()]);
        list.place(inner, outer);
    }
    Aspect aspect;
    static_cast<void>(orExit(aspect.apply(list.take()).map([] { return 0; })));
    return aspect;
}

/// One by one.
ItemRecord recordOf(const DrawItem& item, const ScreenCamera& camera) {
    const Affine3d eye_T_item = camera.eye_T_world * item.world_T_item;
    const Mat3d m = eye_T_item.linear();
    Mat3d cofactors;
    cofactors.row(0) = m.row(1).cross(m.row(2));
    cofactors.row(1) = m.row(2).cross(m.row(0));
    cofactors.row(2) = m.row(0).cross(m.row(1));
    const double largest = cofactors.cwiseAbs().maxCoeff();
    if (largest > 0) cofactors /= m.determinant() < 0 ? -largest : largest;
    ItemRecord record{};
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 4; ++c) {
            const auto row = static_cast<std::size_t>(r), column = static_cast<std::size_t>(c);
            record.eye_T_item[row][column] = static_cast<float>(eye_T_item(r, c));
            if (c < 3) record.normalRows[row][column] = static_cast<float>(cofactors(r, c));
        }
    record.node = {static_cast<std::uint32_t>(item.node.value), static_cast<std::uint32_t>(item.node.value >> 32)};
    return record;
}

/// A tile whose camera alone moves, drawn by a GL that does nothing.
struct ItemStage {
    Aspect aspect;
    RenderScene scene;
    SilentSurface surface;
    std::unique_ptr<Renderer> renderer = orExit(Renderer::create(surface, {.samples = 4}));
    RenderAction action{CullerKind::kFrustum};
    static constexpr PixelRect kRect{.x = 0, .y = 540, .width = 960, .height = 540};
    std::vector<std::uint8_t> pixels = std::vector<std::uint8_t>(std::size_t{4} * kRect.width * kRect.height);
    DrawList list;

    explicit ItemStage(Aspect of) : aspect(std::move(of)) { scene.update(aspect, nullptr); }
    [[nodiscard]] static ScreenCamera cameraOf(const View& view) {
        return screenCamera(benchScreen(), User(), Eye::kCenter, view);
    }
    /// From the scene to GL.
    double frame(const View& view) {
        const ScreenCamera camera = cameraOf(view);
        const double start = threadUs();
        list = action.run(scene, camera, kRect, nullptr);
        const PixelRows rows{.rgbx = pixels.data(), .pitchBytes = std::size_t{4} * kRect.width};
        static_cast<void>(orExit(renderer->drawInto(aspect, list, camera, kRect, rows).map([] { return 0; })));
        return threadUs() - start;
    }
    /// What no frame of the same list can be without: where each of its items lies before the eye, by Eigen.
    [[nodiscard]] double records(const View& view) const {
        const ScreenCamera camera = cameraOf(view);
        std::vector<ItemRecord> made;
        const double start = threadUs();
        for (const DrawItem& item : list.opaque) made.push_back(recordOf(item, camera));
        return threadUs() - start;
    }
};

/// Turning on the spot.
View turned(int frame) {
    View view;
    view.position = {0, 0.5, 0};
    view.orientation = Quatd(Eigen::AngleAxisd(0.003 * frame, Vec3d::UnitY()));
    return view;
}

void frameRow(SceneTable& table, const std::string& name, ItemStage& stage, const std::vector<View>& views) {
    std::vector<double> ours, records;
    double items = 0;
    SilentUploads warm;
    for (std::size_t i = 0; i < views.size(); ++i) {
        if (i == 8) warm = SilentSurface::uploads();
        const double took = stage.frame(views[i]);
        const double least = stage.records(views[i]);
        if (i < 8) continue;  // the first ones upload
        ours.push_back(took);
        records.push_back(least);
        items += static_cast<double>(stage.list.opaque.size());
    }
    const double frames = static_cast<double>(ours.size());
    const SilentUploads after = SilentSurface::uploads();
    table.add({.operation = name + ": a frame up to GL",
               .peer = "places of its items before the eye",
               .ours = medianOf(ours),
               .theirs = medianOf(records),
               .unit = "us",
               .remark = fmt::format("a tile, processor time; {:.0f} items; {:.1f} uploads, {:.0f} bytes a frame",
                                     items / frames, static_cast<double>(after.calls - warm.calls) / frames,
                                     static_cast<double>(after.bytes - warm.bytes) / frames)});
}

}  // namespace

void itemRows(SceneTable& table) {
    table.begin("items");
    constexpr int kFrames = 208;
    std::vector<View> turns;
    for (int i = 0; i < kFrames; ++i) turns.push_back(turned(i));
    for (const int around : {1, 2}) {
        Stage city = cityStage("city", makeCity(16, 16, 12 * around), kFrames);
        const std::string name = fmt::format("city of {} items", 12'096 * around * around);
        ItemStage stage(std::move(city.aspect));
        frameRow(table, name, stage, city.views);
    }
    ObjectId material;
    for (const int count : {12'000, 48'000}) {
        ItemStage stage(crowd(count, 96, material));
        frameRow(table, fmt::format("{} items of 96 materials", count), stage, turns);
    }
    // A material of all: uploads of a frame after it has changed, beside those of one in which nothing has.
    ItemStage stage(crowd(10'000, 1, material));
    std::vector<double> changed, still;
    std::vector<double> changedBytes, stillBytes;
    for (int i = 0; i < 40; ++i) {
        const bool changes = i % 2 == 1;
        if (changes) {
            ChangeListBuilder builder;
            setField<&Material::roughness>(builder, material, 0.3f + 0.01f * static_cast<float>(i));
            const ChangeList list = builder.take();
            static_cast<void>(orExit(stage.aspect.apply(list).map([] { return 0; })));
            stage.scene.update(stage.aspect, &list);
        }
        const SilentUploads before = SilentSurface::uploads();
        static_cast<void>(stage.frame(turned(0)));
        const SilentUploads after = SilentSurface::uploads();
        if (i < 8) continue;
        (changes ? changed : still).push_back(static_cast<double>(after.calls - before.calls));
        (changes ? changedBytes : stillBytes).push_back(static_cast<double>(after.bytes - before.bytes));
    }
    table.add({.operation = "10,000 users of a material: uploads of a frame after it has changed",
               .peer = "of one after nothing has",
               .ours = medianOf(changed),
               .theirs = medianOf(still),
               .unit = "calls",
               .remark = fmt::format("{:.0f} bytes beside {:.0f}", medianOf(changedBytes).value,
                                     medianOf(stillBytes).value)});
}

}  // namespace tessera::bench
