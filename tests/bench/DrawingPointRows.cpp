#include <fmt/format.h>

#include <random>

#include "common/geometry/Points.h"
#include "common/scene/FieldTable.h"
#include "tests/bench/DrawingRows.h"
#include "tests/bench/DrawingStage.h"

namespace tessera::bench {
namespace {

constexpr int kPoints = 1'000'000;

/// A scanned ball of points, coloured.
MeshData scannedBall(int count, double radius) {
    std::mt19937 random(1);
    std::normal_distribution<double> anywhere;
    MeshData points{.primitive = Primitive::kPoints, .pointRadius = radius};
    for (int i = 0; i < count; ++i) {
        const Vec3d at = Vec3d(anywhere(random), anywhere(random), anywhere(random)).normalized();
        for (const double value : at) points.positions.push_back(static_cast<float>(value));
        for (int k = 0; k < 4; ++k)
            points.colors.push_back(k < 3 ? static_cast<std::uint8_t>(random()) : std::uint8_t{255});
    }
    return points;
}

/// It as it is, or as triangles.
Aspect ballOf(const MeshData& mesh) {
    const MeshArrays arrays = mesh.toArrays();
    Geometry geometry;
    geometry.positions = arrays.positions;
    geometry.normals = arrays.normals;
    geometry.colors = arrays.colors;
    geometry.indices = arrays.indices;
    geometry.primitive = arrays.kind == MeshKind::kPoints ? Geometry::kPoints : Geometry::kTriangles;
    geometry.pointRadius = arrays.pointRadius;
    ChangeListBuilder list;
    const ObjectId core{2}, node{3};
    list.create(core, typeOf<Geometry>());
    setAllFields(list, core, Object::of(geometry));
    list.create(node, typeOf<Node>());
    list.set(node, typeOf<Node>(), fieldId<&Node::core>, toValue(core));
    list.place(node, kRootNode);
    Aspect aspect;
    static_cast<void>(orExit(aspect.apply(list.take()).map([] { return 0; })));
    return aspect;
}

/// One way of drawing them, with a renderer of its own.
struct Side {
    Aspect aspect;
    std::unique_ptr<Surface> surface = orExit(makeSurface("osmesa"));
    std::unique_ptr<Renderer> renderer;
    RenderScene scene;
    std::vector<double> frames, uploads;

    explicit Side(const MeshData& mesh) : aspect(ballOf(mesh)) { scene.update(aspect, nullptr); }
    void upload() {
        renderer.reset();
        renderer = orExit(Renderer::create(*surface, {.samples = 4}));
        const double start = processorMs();
        static_cast<void>(orExit(renderer->prepare(
            aspect, {.geometry = ObjectId{2}, .material = {}, .mesh = drawMeshOf(drawableOf(aspect, ObjectId{2}))},
            ~std::size_t{0})));
        uploads.push_back(processorMs() - start);
    }
    Picture frame(const ScreenCamera& camera) {
        RenderAction action(CullerKind::kFrustum);
        const PixelRect rect{.x = 0, .y = 0, .width = 960, .height = 540};
        const double start = processorMs();
        Picture picture = orExit(renderer->draw(aspect, action.run(scene, camera, rect, nullptr), camera, rect));
        frames.push_back(processorMs() - start);
        return picture;
    }
};

}  // namespace

void pointRows(SceneTable& table, int frames) {
    table.begin("points");
    const MeshData points = scannedBall(kPoints, 0.001);
    Side ours(points), theirs(trianglesOfPoints(points.toArrays()));
    for (int i = 0; i < 3; ++i) {
        ours.upload();
        theirs.upload();
    }
    View view;
    view.position = {0, 0, 1.5};
    const ScreenCamera camera = screenCamera(benchScreen(), User(), Eye::kCenter, view);
    const auto drawInTurn = [&](Side& one, Side& other) {
        for (int i = 0; i <= frames; ++i) {
            static_cast<void>(one.frame(camera));
            static_cast<void>(other.frame(camera));
        }
        for (Side* side : {&one, &other}) side->frames.erase(side->frames.begin());
    };
    drawInTurn(ours, theirs);
    const std::string peer = "octahedra as triangles";
    const auto megabytes = [](const Side& side) {
        return Median{.value = 1e-6 * static_cast<double>(side.renderer->residentBytes()), .spread = 0, .count = 1};
    };
    table.add({.operation = "a million points with colours: memory of GL",
               .peer = peer,
               .ours = megabytes(ours),
               .theirs = megabytes(theirs),
               .unit = "MB",
               .atMost = 0.05});
    table.add({.operation = "the same: uploaded",
               .peer = peer,
               .ours = medianOf(ours.uploads),
               .theirs = medianOf(theirs.uploads),
               .unit = "ms"});
    table.add({.operation = "the same: a frame of 960x540",
               .peer = peer,
               .ours = medianOf(ours.frames),
               .theirs = medianOf(theirs.frames),
               .unit = "ms",
               .atMost = 1.1});
    // Larger and fewer.
    for (const auto& [count, radius] :
         {std::pair(300'000, 0.002), {100'000, 0.004}, {30'000, 0.008}, {10'000, 0.016}, {3'000, 0.03}}) {
        const MeshData larger = scannedBall(count, radius);
        Side balls(larger), octahedra(trianglesOfPoints(larger.toArrays()));
        for (Side* side : {&balls, &octahedra}) side->upload();
        drawInTurn(balls, octahedra);
        const double pixels = radius * 0.5 * camera.clip_T_eye(0, 0) * camera.pixels.width / 0.5;
        table.add({.operation = fmt::format("{} points of {:.1f} pixels and less: a frame", count, pixels),
                   .peer = peer,
                   .ours = medianOf(balls.frames),
                   .theirs = medianOf(octahedra.frames),
                   .unit = "ms"});
    }
}

}  // namespace tessera::bench
