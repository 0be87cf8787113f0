#include "tests/bench/DrawingStage.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <unordered_map>

#include "common/cores/Transform.h"
#include "common/geometry/TriangleOrder.h"
#include "common/scene/FieldTable.h"
#include "server/import/Importer.h"
#include "tests/bench/VisibleItems.h"

namespace tessera::bench {
namespace {

/// Things at places, without a hierarchy.
class SceneWriter {
public:
    ObjectId geometry(const MeshData& mesh) {
        const ObjectId id{next_++};
        const MeshArrays arrays = mesh.toArrays();
        list_.create(id, typeOf<Geometry>());
        list_.set(id, typeOf<Geometry>(), fieldId<&Geometry::positions>, toValue(arrays.positions));
        list_.set(id, typeOf<Geometry>(), fieldId<&Geometry::normals>, toValue(arrays.normals));
        list_.set(id, typeOf<Geometry>(), fieldId<&Geometry::indices>, toValue(arrays.indices));
        return id;
    }
    ObjectId geometry(const Geometry& mesh) {
        const ObjectId id{next_++};
        list_.create(id, typeOf<Geometry>());
        list_.set(id, typeOf<Geometry>(), fieldId<&Geometry::positions>, toValue(mesh.positions));
        list_.set(id, typeOf<Geometry>(), fieldId<&Geometry::normals>, toValue(mesh.normals));
        list_.set(id, typeOf<Geometry>(), fieldId<&Geometry::indices>, toValue(mesh.indices));
        return id;
    }
    void put(ObjectId core, const Vec3d& at, const Vec3d& size, const Quatd& rotation = Quatd::Identity()) {
        const ObjectId place{next_++}, outer{next_++}, inner{next_++};
        list_.create(place, typeOf<Transform>());
        list_.set(place, typeOf<Transform>(), fieldId<&Transform::translation>, toValue(at));
        list_.set(place, typeOf<Transform>(), fieldId<&Transform::rotation>, toValue(rotation));
        list_.set(place, typeOf<Transform>(), fieldId<&Transform::scale>, toValue(size));
        list_.create(outer, typeOf<Node>());
        list_.set(outer, typeOf<Node>(), fieldId<&Node::core>, toValue(place));
        list_.place(outer, kRootNode);
        list_.create(inner, typeOf<Node>());
        list_.set(inner, typeOf<Node>(), fieldId<&Node::core>, toValue(core));
        list_.place(inner, outer);
    }
    Stage stage(std::string name) {
        Stage made;
        made.name = std::move(name);
        static_cast<void>(orExit(made.aspect.apply(list_.take()).map([] { return 0; })));
        return made;
    }

private:
    ChangeListBuilder list_;
    std::uint64_t next_ = 2;
};

/// Each triangle becomes four; corners in the middle of edges go off by a share of the edge's length, so that no two
/// faces lie in one plane.
MeshData divided(const MeshData& mesh, std::mt19937& random) {
    std::uniform_real_distribution<float> off(-0.04f, 0.04f);
    MeshData finer;
    finer.positions = mesh.positions;
    finer.normals = mesh.normals;
    std::unordered_map<std::uint64_t, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
        const auto [it, isNew] = middles.try_emplace(std::uint64_t{std::min(a, b)} << 32 | std::max(a, b),
                                                     static_cast<std::uint32_t>(finer.positions.size() / 3));
        if (!isNew) return it->second;
        Vec3f p[2], n[2];
        for (int i = 0; i < 2; ++i) {
            const std::size_t at = 3 * std::size_t{i == 0 ? a : b};
            p[i] = {finer.positions[at], finer.positions[at + 1], finer.positions[at + 2]};
            n[i] = {finer.normals[at], finer.normals[at + 1], finer.normals[at + 2]};
        }
        const Vec3f normal = (n[0] + n[1]).normalized();
        const Vec3f at = 0.5f * (p[0] + p[1]) + off(random) * (p[0] - p[1]).norm() * normal;
        finer.positions.insert(finer.positions.end(), at.data(), at.data() + 3);
        finer.normals.insert(finer.normals.end(), normal.data(), normal.data() + 3);
        return it->second;
    };
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
        const std::uint32_t a = mesh.indices[i], b = mesh.indices[i + 1], c = mesh.indices[i + 2];
        const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
        finer.indices.insert(finer.indices.end(), {a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca});
    }
    return finer;
}

}  // namespace

Expected<std::vector<Geometry>> readGeometries(const std::vector<std::string>& files) {
    const auto imported =
        importScenes(files, kRootNode, {.allowUnconfined = true, .importerProgram = TESSERA_BIN_DIR "/tessera-import"});
    if (!imported) return tl::unexpected(imported.error());
    ChangeList list = imported->list;
    replaceIds(list, [](ObjectId id) { return isPlaceholder(id) ? ObjectId{id.value - kFirstPlaceholder + 2} : id; });
    Aspect aspect;
    if (auto applied = aspect.apply(list); !applied) return tl::unexpected(applied.error());
    std::vector<Geometry> found;
    for (const ObjectId id : aspect.ids())
        if (const auto* geometry = aspect.get<Geometry>(id)) found.push_back(*geometry);
    return found;
}

Stage cityStage(std::string name, const City& city, int frames) {
    SceneWriter scene;
    std::vector<ObjectId> geometries;
    for (const MeshData& mesh : city.meshes) {
        MeshData ordered = mesh;
        ordered.indices = inSpatialOrder(mesh.positions, mesh.indices);
        geometries.push_back(scene.geometry(ordered));
    }
    for (const City::Place& place : city.places) scene.put(geometries[place.mesh], place.at, place.size);
    Stage stage = scene.stage(std::move(name));
    for (int i = 0; i < frames; ++i) stage.views.push_back(cityView(static_cast<double>(i) / frames));
    return stage;
}

Stage fieldStage(int frames) {
    std::mt19937 random(2);
    std::uniform_real_distribution<double> anywhere(-60, 60);
    SceneWriter scene;
    const ObjectId thing = scene.geometry(makeTorus(0.7, 0.3, 12, 10));
    for (int i = 0; i < 8'000; ++i) scene.put(thing, {anywhere(random), 0.2, anywhere(random)}, Vec3d::Constant(0.25));
    Stage stage = scene.stage("open field");
    for (int i = 0; i < frames; ++i) {
        View view;
        view.position = {0, 9, 60.0 - 40.0 * i / frames};
        view.orientation = Quatd(Eigen::AngleAxisd(-0.35, Vec3d::UnitX()));
        stage.views.push_back(view);
    }
    return stage;
}

Expected<Stage> plantStage(const std::string& folder, int frames) {
    std::vector<std::string> files;
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(folder, error))
        if (entry.path().extension() == ".obj" && entry.path().stem() != "background")
            files.push_back(entry.path().string());
    if (files.empty()) return fail(ErrorCode::kNotFound, folder + ": no plant (--plant FOLDER)");
    std::sort(files.begin(), files.end());
    auto parts = readGeometries(files);
    if (!parts) return tl::unexpected(parts.error());
    Box box;
    SceneWriter scene;
    std::vector<ObjectId> cores;
    for (const Geometry& part : *parts) {
        box.extend(boundsOf(part.positions.as<float>()));
        cores.push_back(scene.geometry(part));
    }
    // Rows and columns of plants four metres wide, as halls have them.
    const double scale = 4 / box.size().maxCoeff();
    constexpr int kColumns = 10, kRows = 14;
    for (int column = 0; column < kColumns; ++column)
        for (int row = 0; row < kRows; ++row)
            for (const ObjectId core : cores)
                scene.put(core, Vec3d(4.5 * (column - 4.5), 0, -4.5 * row) - scale * box.center(),
                          Vec3d::Constant(scale));
    Stage stage = scene.stage("plant, 50 M triangles");
    for (int i = 0; i < frames; ++i) {
        const double t = static_cast<double>(i) / frames;
        View view;
        view.position = {0.2 * std::sin(9 * t), -1.2, 2 - 40 * t};
        view.orientation = Quatd(Eigen::AngleAxisd(0.4 * std::sin(7 * t), Vec3d::UnitY()));
        stage.views.push_back(view);
    }
    return stage;
}

Expected<Stage> scanStage(const std::string& file, int frames) {
    auto read = readGeometries({file});
    if (!read) return tl::unexpected(read.error());
    if (read->empty()) return fail(ErrorCode::kNotFound, file + ": no mesh (--scan FILE)");
    MeshData mesh;
    const Geometry& scan = read->front();
    mesh.positions.assign(scan.positions.as<float>().begin(), scan.positions.as<float>().end());
    mesh.normals.assign(scan.normals.as<float>().begin(), scan.normals.as<float>().end());
    mesh.indices.assign(scan.indices.as<std::uint32_t>().begin(), scan.indices.as<std::uint32_t>().end());
    if (mesh.normals.size() != mesh.positions.size())
        return fail(ErrorCode::kBadInput, file + ": a mesh without normals");
    std::mt19937 random(3);
    mesh = divided(divided(mesh, random), random);
    mesh.indices = inSpatialOrder(mesh.positions, mesh.indices);
    const Box box = boundsOf(mesh.positions);
    const double scale = 2 / box.size().maxCoeff();
    SceneWriter scene;
    scene.put(scene.geometry(mesh), -scale * box.center(), Vec3d::Constant(scale));
    Stage stage = scene.stage(std::to_string(mesh.indices.size() / 3) + " scanned triangles, close up");
    for (int i = 0; i < frames; ++i) {
        View view;
        const double angle = 6.28 * i / frames;
        view.orientation = Quatd(Eigen::AngleAxisd(angle, Vec3d::UnitY()));
        // The eye a third of the model's size before its surface.
        view.position = view.orientation * Vec3d(0, -1.5, -0.9);
        stage.views.push_back(view);
    }
    return stage;
}

CullCost measureCulling(Stage& stage, CullerKind ours, CullerKind all, bool withOracle, bool tellEach) {
    constexpr int kSamples = 4;
    const Screen screen = benchScreen();
    const auto surface = orExit(makeSurface("osmesa"));
    const auto renderer = orExit(Renderer::create(*surface, {.samples = kSamples}));
    RenderScene scene;
    scene.update(stage.aspect, nullptr);
    const int width = screen.grid.tileWidthPx, height = screen.grid.tileHeightPx;
    // One per tile, as hosts have them.
    std::vector<std::unique_ptr<RenderAction>> actions;
    for (int tile = 0; tile < 4; ++tile) actions.push_back(std::make_unique<RenderAction>(ours));
    RenderAction other(all);
    CullCost cost;
    double tiles = 0;
    const auto frame = [&](const View& view, bool counts) {
        const ScreenCamera camera = screenCamera(screen, User(), Eye::kCenter, view);
        double ourMs = 0, allMs = 0, oracleMs = 0;
        for (int tile = 0; tile < 4; ++tile) {
            const PixelRect rect{tile % 2 * width, tile / 2 * height, width, height};
            double cullMs = 0;
            Picture picture;
            const auto one = [&](RenderAction& action, double& ms, CullCounts* count, std::uint64_t& triangles) {
                const double start = processorMs();
                DrawList list = action.run(scene, camera, rect, count);
                cullMs = processorMs() - start;
                picture = orExit(renderer->draw(stage.aspect, list, camera, rect));
                ms += processorMs() - start;
                triangles = renderer->lastCounts().triangles;
                return list;
            };
            CullCounts count;
            std::uint64_t ourTriangles = 0, allTriangles = 0, oracleTriangles = 0;
            const double before = ourMs;
            one(*actions[static_cast<std::size_t>(tile)], ourMs, &count, ourTriangles);
            const double ourCullMs = cullMs, ourTileMs = ourMs - before;
            const Picture ourPicture = std::move(picture);
            DrawList list = one(other, allMs, nullptr, allTriangles);
            double oracleTileMs = 0;
            if (withOracle) {
                list = visibleItems(*renderer, stage.aspect, std::move(list), camera, rect, kSamples);
                picture = orExit(
                    renderer->draw(stage.aspect, list, camera, rect));  // brings the buffers back to a tile's size
                const double start = processorMs();
                picture = orExit(renderer->draw(stage.aspect, list, camera, rect));
                oracleTileMs = processorMs() - start;
                oracleTriangles = renderer->lastCounts().triangles;
                oracleMs += oracleTileMs;
                cost.oracleWrong += picture.rgb != ourPicture.rgb;
            }
            if (!counts) continue;
            const std::size_t visible = list.opaque.size() + list.transparent.size();
            if (tellEach)
                std::printf(
                    "  frame %2zu tile %d: %5llu in the frustum, %5llu drawn%s, %5zu visible; %8llu, %8llu, %8llu "
                    "triangles "
                    "of ours, the oracle, all; %6.1f ms, %5.1f of them culling, oracle %6.1f\n",
                    cost.ours.size(), tile, static_cast<unsigned long long>(count.inFrustum),
                    static_cast<unsigned long long>(count.drawn), count.looked ? "" : " (did not look)", visible,
                    static_cast<unsigned long long>(ourTriangles), static_cast<unsigned long long>(oracleTriangles),
                    static_cast<unsigned long long>(allTriangles), ourTileMs, ourCullMs, oracleTileMs);
            ++tiles;
            cost.inFrustum += static_cast<double>(count.inFrustum);
            cost.drawn += static_cast<double>(count.drawn);
            cost.visible += static_cast<double>(visible);
            cost.cullMs += ourCullMs;
            cost.triangles += ourTriangles;
            cost.allTriangles += allTriangles;
            cost.oracleTriangles += oracleTriangles;
        }
        if (!counts) return;
        cost.ours.push_back(ourMs);
        cost.all.push_back(allMs);
        cost.oracle.push_back(oracleMs);
    };
    // Meshes are uploaded and made ready for hiding before anything counts: the first view, some times.
    for (int i = 0; i < 3; ++i) frame(stage.views.front(), false);
    for (const View& view : stage.views) frame(view, true);
    cost.inFrustum /= tiles;
    cost.drawn /= tiles;
    cost.visible /= tiles;
    cost.cullMs /= static_cast<double>(stage.views.size());
    return cost;
}

}  // namespace tessera::bench
