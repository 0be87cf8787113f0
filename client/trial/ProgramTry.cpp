#include "client/trial/ProgramTry.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <ctime>

#include "client/draw/shaders/PersonText.h"
#include "client/render/order/RenderAction.h"
#include "common/cores/DirectionalLight.h"
#include "common/cores/Geometry.h"
#include "common/cores/SurfaceParts.h"
#include "common/cores/Transform.h"
#include "common/geometry/Mesh.h"
#include "common/scene/FieldTable.h"

namespace tessera {
namespace {

double processorSeconds() {
    timespec now{};
    ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Objects of a scene for one picture.
class TrialScene {
public:
    template <typename T>
    ObjectId add(const T& object) {
        const ObjectId id{next_++};
        list_.create(id, T::kType);
        setAllFields(list_, id, Object::of(object));
        return id;
    }
    void show(ObjectId core, ObjectId parent) { (void)node(core, parent); }
    ObjectId node(ObjectId core, ObjectId parent) {
        const ObjectId id{next_++};
        list_.create(id, typeOf<Node>());
        list_.set(id, typeOf<Node>(), fieldId<&Node::core>, toValue(core));
        list_.place(id, parent);
        return id;
    }
    Expected<Aspect> take() {
        Aspect aspect;
        if (auto applied = aspect.apply(list_.take()); !applied) return tl::unexpected(applied.error());
        return aspect;
    }

private:
    ChangeListBuilder list_;
    std::uint64_t next_ = 2;
};

MeshData sheet() {
    MeshData mesh;
    mesh.positions = {-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0};
    mesh.normals = {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1};
    mesh.texcoords = {0, 1, 1, 1, 1, 0, 0, 0};
    mesh.indices = {0, 1, 2, 0, 2, 3};
    return mesh;
}

ScreenCamera cameraBefore() {
    Screen screen;
    screen.lowerLeft = {-1, -1, 0};
    screen.lowerRight = {1, -1, 0};
    screen.upperLeft = {-1, 1, 0};
    screen.grid.tileWidthPx = screen.grid.tileHeightPx = ProgramTry::kSidePx;
    User user;
    user.position = {0, 0, 3};
    return screenCamera(screen, user, Eye::kCenter, View());
}

}  // namespace

Expected<std::unique_ptr<ProgramTry>> ProgramTry::create() {
    limitDrawThreads(0);
    std::unique_ptr<ProgramTry> made(new ProgramTry);
    auto surface = makeSurface("osmesa");
    if (!surface) return tl::unexpected(surface.error());
    made->surface_ = std::move(*surface);
    auto renderer = Renderer::create(*made->surface_, {.samples = 1, .programsMost = std::chrono::milliseconds(0)});
    if (!renderer) return tl::unexpected(renderer.error());
    made->renderer_ = std::move(*renderer);
    if (auto drawn = made->draw(nullptr, 0, false); !drawn) return tl::unexpected(drawn.error());
    return made;
}

Expected<double> ProgramTry::draw(const SurfaceProgram* program, float uniforms, bool timed) {
    TrialScene scene;
    Material base;
    base.doubleSided = true;
    if (program) {
        SurfaceProgram good = *program;
        good.verdict = SurfaceProgram::kGood;
        base.program = scene.add(good);
        if (const auto text = preparePersonText(program->surface, program->vertex))
            for (const PersonUniform& uniform : text->uniforms)
                base.uniforms.push_back(
                    scene.add(Uniform{.name = uniform.name, .value = Vec4f::Constant(uniforms), .image = {}}));
    }
    const MeshArrays arrays = sheet().toArrays();
    const ObjectId top = scene.node(ObjectId(), kRootNode);
    for (const std::int64_t alpha : {Material::kOpaque, Material::kMask, Material::kBlend}) {
        Material material = base;
        material.alphaMode = alpha;
        Geometry geometry;
        geometry.positions = arrays.positions;
        geometry.normals = arrays.normals;
        geometry.texcoords = arrays.texcoords;
        geometry.indices = arrays.indices;
        geometry.material = scene.add(material);
        Transform place;
        place.translation = {0, 0, alpha == Material::kBlend ? 0.2 : alpha == Material::kMask ? 0.1 : 0.0};
        scene.show(scene.add(geometry), scene.node(scene.add(place), top));
    }
    DirectionalLight sun;
    sun.shadows = true;
    scene.show(scene.add(sun), top);
    const Expected<Aspect> aspect = scene.take();
    if (!aspect) return tl::unexpected(aspect.error());
    RenderScene shown;
    shown.update(*aspect, nullptr);
    const ScreenCamera camera = cameraBefore();
    const PixelRect all{.x = 0, .y = 0, .width = kSidePx, .height = kSidePx};
    const DrawList list = RenderAction(CullerKind::kNone).run(shown, camera, all, nullptr);
    double least = 1e30;
    // What compiles for the first time is no time of the program's: of some pictures the fastest.
    for (int i = 0; i < (timed ? 3 : 1); ++i) {
        const double begun = processorSeconds();
        if (auto drawn = renderer_->draw(*aspect, list, camera, all); !drawn) return tl::unexpected(drawn.error());
        if (i > 0 || !timed) least = std::min(least, processorSeconds() - begun);
    }
    if (auto ids = renderer_->drawNodeIds(*aspect, list, camera, all); !ids) return tl::unexpected(ids.error());
    return least;
}

std::string ProgramTry::problemOf(const SurfaceProgram& program) {
    if (const auto text = preparePersonText(program.surface, program.vertex); !text) return text.error().message;
    for (const float uniforms : {0.0f, 1.0f}) {
        const Expected<double> seconds = draw(&program, uniforms, true);
        if (!seconds) return seconds.error().message;
        std::string trouble = renderer_->lastCounts().trouble;
        if (const std::string_view begins = "a program of a material: "; trouble.starts_with(begins))
            return trouble.substr(begins.size());
        if (!trouble.empty()) return trouble;
        // Three sheets, each as large as the picture.
        const double microseconds = 1e6 * *seconds / (3.0 * kSidePx * kSidePx);
        if (microseconds > kMostMicroseconds)
            return fmt::format(
                "surface, line 1: it takes {:.1f} µs of a processor for a pixel with its uniforms {}; {} may be",
                microseconds, uniforms > 0 ? 1 : 0, kMostMicroseconds);
    }
    return {};
}

}  // namespace tessera
