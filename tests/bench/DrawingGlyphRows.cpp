#include <fmt/format.h>

#include <array>
#include <random>

#include "common/drawable/Drawable.h"
#include "common/drawable/GlyphArrays.h"
#include "common/geometry/MeshCopies.h"
#include "common/scene/FieldTable.h"
#include "tests/bench/DrawingRows.h"
#include "tests/bench/DrawingStage.h"

namespace tessera::bench {
namespace {

/// Arrows of a flow in a box.
Glyphs flowOf(std::size_t count) {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> anywhere(-1, 1);
    std::vector<float> places, vectors, scalars;
    for (std::size_t i = 0; i < count; ++i) {
        const float x = anywhere(random), y = anywhere(random), z = anywhere(random);
        places.insert(places.end(), {x, y, z});
        vectors.insert(vectors.end(), {-z, 0.3F * x, x});
        scalars.push_back(x * x + z * z);
    }
    const std::array<std::uint8_t, 8> stops{20, 60, 255, 255, 255, 120, 10, 255};
    Glyphs flow;
    flow.positions = Blob::of(std::span<const float>(places));
    flow.vectors = Blob::of(std::span<const float>(vectors));
    flow.scalars = Blob::of(std::span<const float>(scalars));
    flow.transfer = Blob::of(std::span<const std::uint8_t>(stops));
    flow.size = 0.06;
    flow.high = 2;
    return flow;
}

/// Their triangles, in the order in which screens draw glyphs.
Geometry trianglesOf(const Glyphs& glyphs) {
    const MeshArrays arrays = drawableOf(Object::of(glyphs)).at(kGlyphsOnScreens).arrays();
    const std::span<const float> corners = arrays.positions.as<float>(), normals = arrays.normals.as<float>();
    const std::size_t each = corners.size() / 3;
    MeshData mesh;
    const auto add = [](std::vector<float>& to, const Vec3d& v) {
        for (int axis = 0; axis < 3; ++axis) to.push_back(static_cast<float>(v[axis]));
    };
    for (std::size_t k = 0; k < copyCount(arrays); ++k) {
        const MeshCopy& copy = arrays.copies.as<MeshCopy>()[k];
        const Quatd turn(copy.turn[3], copy.turn[0], copy.turn[1], copy.turn[2]);
        const Vec3d place(copy.place[0], copy.place[1], copy.place[2]), scale(copy.width, copy.length, copy.width),
            inverse(copy.length, copy.width, copy.length);
        for (std::size_t c = 0; c < each; ++c) {
            add(mesh.positions,
                place + turn * scale.cwiseProduct(Vec3d(corners[3 * c], corners[3 * c + 1], corners[3 * c + 2])));
            add(mesh.normals,
                turn * inverse.cwiseProduct(Vec3d(normals[3 * c], normals[3 * c + 1], normals[3 * c + 2])));
            for (std::size_t i = 0; i < 4; ++i) mesh.colors.push_back(arrays.colors.as<std::uint8_t>()[4 * k + i]);
        }
        for (const std::uint32_t index : arrays.indices.as<std::uint32_t>())
            mesh.indices.push_back(static_cast<std::uint32_t>(each * k) + index);
    }
    const MeshArrays whole = mesh.toArrays();
    Geometry geometry;
    geometry.positions = whole.positions;
    geometry.normals = whole.normals;
    geometry.colors = whole.colors;
    geometry.indices = whole.indices;
    return geometry;
}

/// One way of drawing them on four tiles, with a renderer of its own.
struct FlowSide {
    Aspect aspect;
    std::unique_ptr<Surface> surface = orExit(makeSurface("osmesa"));
    std::unique_ptr<Renderer> renderer;
    RenderScene scene;
    RenderAction action{CullerKind::kMasked};
    std::vector<double> frames, uploads;
    double wireBytes = 0;

    template <typename Core>
    explicit FlowSide(const Core& core) {
        ChangeListBuilder list;
        const ObjectId id{2}, node{3};
        list.create(id, typeOf<Core>());
        setAllFields(list, id, Object::of(core));
        list.create(node, typeOf<Node>());
        list.set(node, typeOf<Node>(), fieldId<&Node::core>, toValue(id));
        list.place(node, kRootNode);
        static_cast<void>(orExit(aspect.apply(list.take()).map([] { return 0; })));
        scene.update(aspect, nullptr);
        const Object object = aspect.find(id);
        for (const FieldEntry& field : object.info().fields) {
            const FieldValue value = field.load(object);
            if (const auto* blob = std::get_if<Blob>(&value)) wireBytes += static_cast<double>(blob->sizeBytes());
        }
    }
    void upload(unsigned fineness) {
        renderer.reset();
        renderer = orExit(Renderer::create(*surface, {.samples = 4}));
        const double start = processorMs();
        static_cast<void>(orExit(renderer->prepare(
            aspect,
            {.geometry = ObjectId{2}, .material = {}, .mesh = drawMeshOf(drawableOf(aspect, ObjectId{2}).at(fineness))},
            ~std::size_t{0})));
        uploads.push_back(processorMs() - start);
    }
    void frame(const ScreenCamera& camera) {
        const double start = processorMs();
        for (int y = 0; y < 2; ++y)
            for (int x = 0; x < 2; ++x) {
                const PixelRect tile{.x = 480 * x, .y = 270 * y, .width = 480, .height = 270};
                static_cast<void>(
                    orExit(renderer->draw(aspect, action.run(scene, camera, tile, nullptr), camera, tile)));
            }
        frames.push_back(processorMs() - start);
    }
};

}  // namespace

void glyphRows(SceneTable& table, int frames) {
    table.begin("glyphs");
    const Glyphs flow = flowOf(100'000);
    FlowSide ours(flow), theirs(trianglesOf(flow));
    for (int i = 0; i < 3; ++i) {
        ours.upload(kGlyphsOnScreens);
        theirs.upload(0);
    }
    const std::string peer = "one Geometry of their triangles";
    const auto megabytes = [](double bytes) { return Median{.value = 1e-6 * bytes, .spread = 0, .count = 1}; };
    const auto resident = [&](const FlowSide& side) {
        return megabytes(static_cast<double>(side.renderer->residentBytes()));
    };
    table.add({.operation = "100,000 arrows: arrays that travel",
               .peer = peer,
               .ours = megabytes(ours.wireBytes),
               .theirs = megabytes(theirs.wireBytes),
               .unit = "MB",
               .atMost = 0.05});
    table.add({.operation = "the same: memory of GL",
               .peer = peer,
               .ours = resident(ours),
               .theirs = resident(theirs),
               .unit = "MB",
               .atMost = 0.05});
    table.add({.operation = "the same: uploaded",
               .peer = peer,
               .ours = medianOf(ours.uploads),
               .theirs = medianOf(theirs.uploads),
               .unit = "ms"});
    for (const auto& [what, distance] : {std::pair("all of it seen", 3.5), {"from within", 0.2}}) {
        View view;
        view.position = {0, 0, distance};
        const ScreenCamera camera = screenCamera(benchScreen(), User(), Eye::kCenter, view);
        for (FlowSide* side : {&ours, &theirs}) side->frames.clear();
        for (int i = 0; i <= frames; ++i)
            for (FlowSide* side : {&ours, &theirs}) side->frame(camera);
        for (FlowSide* side : {&ours, &theirs}) side->frames.erase(side->frames.begin());
        table.add({.operation = fmt::format("the same: a frame of four tiles, {}", what),
                   .peer = peer,
                   .ours = medianOf(ours.frames),
                   .theirs = medianOf(theirs.frames),
                   .unit = "ms",
                   .atMost = 1.5});
    }
}

}  // namespace tessera::bench
