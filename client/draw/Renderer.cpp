#include "client/draw/Renderer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <map>
#include <set>

#include "client/draw/DepthQueries.h"
#include "client/draw/DrawCalls.h"
#include "client/draw/LightBuffers.h"
#include "client/draw/ScreenCells.h"
#include "client/draw/ShadowMaps.h"
#include "client/draw/TileBuffers.h"

namespace tessera {
namespace {

/// A tile's scissor lies on this grid: it is the software rasteriser's own, and makes seams exact.
constexpr int kGridPx = 64;

// Texture units, as the shaders have them: those of materials are no others', as a sampler stays bound to its unit.
constexpr GLuint kFirstMapUnit = 3, kDetailUnit = kFirstMapUnit + kImageMaps,
                 kLightUnit = kDetailUnit + 1, kListUnit = kLightUnit + 1,
                 kSurroundingsUnit = kListUnit + 1, kShadowUnit = kSurroundingsUnit + 1;

/// The tile's rectangle grown outwards to the grid.
PixelRect grownToGrid(const PixelRect& r) {
    const int left = r.x / kGridPx * kGridPx;
    const int bottom = r.y / kGridPx * kGridPx;
    const int right = (r.x + r.width + kGridPx - 1) / kGridPx * kGridPx;
    const int top = (r.y + r.height + kGridPx - 1) / kGridPx * kGridPx;
    return {.x = left, .y = bottom, .width = right - left, .height = top - bottom};
}

Expected<void> checkRect(const ScreenCamera& camera, const PixelRect& r) {
    if (r.x < 0 || r.y < 0 || r.width <= 0 || r.height <= 0 || r.width > camera.pixels.width - r.x ||
        r.height > camera.pixels.height - r.y)
        return fail(ErrorCode::kBadInput,
                    fmt::format("a tile of {}x{} at {},{} does not lie on its screen of {}x{}", r.width, r.height, r.x,
                                r.y, camera.pixels.width, camera.pixels.height));
    return {};
}

/// From the origin to the farthest corner.
double reachOf(const Box& box, const Vec3d& origin) {
    return (box.upper - origin).cwiseAbs().cwiseMax((box.lower - origin).cwiseAbs()).norm();
}

Picture toPicture(const std::vector<std::uint8_t>& rgba, int widthPx, int heightPx) {
    Picture picture{.widthPx = widthPx, .heightPx = heightPx, .rgb = {}};
    const auto width = static_cast<std::size_t>(widthPx);
    const auto height = static_cast<std::size_t>(heightPx);
    picture.rgb.resize(3 * width * height);
    std::uint8_t* out = picture.rgb.data();
    for (std::size_t y = height; y-- > 0;) {
        const std::uint8_t* in = rgba.data() + 4 * width * y;
        for (std::size_t x = 0; x < width; ++x, in += 4, out += 3) {
            out[0] = in[0];
            out[1] = in[1];
            out[2] = in[2];
        }
    }
    return picture;
}

}  // namespace

struct Renderer::Impl {
    Impl(Surface& onSurface, GlFunctions functions, RendererOptions o);
    ~Impl();

    [[nodiscard]] Expected<void> begin(const Aspect& aspect, const DrawList& list, const ScreenCamera& camera,
                                       const PixelRect& rect);
    [[nodiscard]] Expected<void> beginCell(const DrawList& list, const ScreenCamera& screen, const CellPart& cell,
                                           TileBuffers& buffers);
    /// What is to be drawn of a list, seen from here.
    void collect(const Aspect& aspect, const DrawList& list, const ScreenCamera& camera);
    [[nodiscard]] Expected<void> drawShadows(const Aspect& aspect, std::size_t index);
    void setUp(const FrameBlock& block, const PixelRect& viewport, GLuint framebuffer);
    [[nodiscard]] Expected<void> drawCell(const DrawList& list, const ScreenCamera& screen, const CellPart& cell);
    /// Into rows of `rect`, from below.
    void readBack(GLuint framebuffer, const CellPart& cell, const PixelRect& rect, GLenum format, GLenum type,
                  std::size_t bytesPerPixel, void* rows);
    [[nodiscard]] Expected<GLuint> program(const ProgramKind& kind);
    [[nodiscard]] Expected<void> useProgram(const ProgramKind& kind);
    /// The program for something of this list; for one of its calls.
    [[nodiscard]] ProgramKind kindOf(ProgramKind::Use use) const;
    [[nodiscard]] ProgramKind kindOf(ProgramKind::Use use, const DrawCall& call) const;
    [[nodiscard]] Expected<void> issue(std::size_t first, std::size_t last, ProgramKind::Use use);
    void bindLook(std::uint32_t index, std::uint8_t maps);
    [[nodiscard]] Expected<void> drawOverScreen(const ProgramKind& kind);
    /// Compiles, for all that is set now, what the next draw would need if the scene's lights were others.
    [[nodiscard]] Expected<void> prepareForShadows(const ProgramKind& kind);
    [[nodiscard]] Expected<void> prepareForOtherLights(const ProgramKind& kind);
    [[nodiscard]] Expected<void> lightSurfaces();
    [[nodiscard]] Expected<void> copyToSamples();
    [[nodiscard]] Expected<void> blendTransparent();
    void bindSurfaces();
    /// Whether the cell may show anything transparent.
    [[nodiscard]] bool blends() const;

    Surface& surface;
    GlFunctions gl;
    RendererOptions options;
    std::map<ProgramKind, Program> programs;  ///< made when first needed
    std::set<ProgramKind> prepared;           ///< `otherwiseLit`: made for all lights
    GLuint vertexArray = 0, emptyArray = 0;
    GLuint itemBuffer = 0, sortedBuffer = 0, lookBuffer = 0, frameBuffer = 0, materialBuffer = 0, materialTexture = 0;
    std::unique_ptr<MeshBuffers> meshes;
    TextureCache textures;
    TileBuffers tile, ids;
    LightBuffers lights;
    EnvironmentTexture surroundings;
    ShadowMaps shadows;
    std::unique_ptr<DepthQueries> depths;  ///< made when a culler asks

    // Of the list being drawn.
    DrawCalls calls;
    // Of the cell being drawn, by call: which runs of triangles it may show, of all that are.
    struct Span {
        std::uint32_t first = 0, end = 0;
    };
    std::vector<Span> inCell;
    std::vector<TriangleRun> runs;
    std::vector<GLsizei> counts;
    std::vector<const void*> offsets;
    std::vector<GLint> baseVertices;
    std::uint64_t triangles = 0, lightsLeftOut = 0, shadowsLeftOut = 0;
    PixelRect scissor;
    GLuint surfacesNow = 0;  ///< the framebuffer that `setUp` has bound
    ProgramKind scene;  ///< what all programs of the list share
};

Renderer::Impl::Impl(Surface& onSurface, GlFunctions functions, RendererOptions o)
    : surface(onSurface),
      gl(functions),
      options(o),
      textures(gl, o.textureBudgetBytes),
      tile(gl, o.samples),
      ids(gl, 1),
      lights(gl),
      surroundings(gl),
      shadows(gl) {
    gl.CreateVertexArrays(1, &vertexArray);
    gl.CreateVertexArrays(1, &emptyArray);
    for (GLuint* buffer : {&itemBuffer, &lookBuffer, &frameBuffer, &materialBuffer, &sortedBuffer}) gl.CreateBuffers(1, buffer);
    gl.NamedBufferData(frameBuffer, sizeof(FrameBlock), nullptr, GL_STREAM_DRAW);
    gl.CreateTextures(GL_TEXTURE_BUFFER, 1, &materialTexture);

    const auto attribute = [&](GLuint location, GLint width, GLenum type, GLboolean normalised, std::size_t offset) {
        gl.EnableVertexArrayAttrib(vertexArray, location);
        gl.VertexArrayAttribFormat(vertexArray, location, width, type, normalised, static_cast<GLuint>(offset));
        gl.VertexArrayAttribBinding(vertexArray, location, 0);
    };
    attribute(0, 3, GL_FLOAT, GL_FALSE, offsetof(MeshVertex, position));
    attribute(1, 3, GL_FLOAT, GL_FALSE, offsetof(MeshVertex, normal));
    attribute(2, 4, GL_UNSIGNED_SHORT, GL_TRUE, offsetof(MeshVertex, color));
    attribute(3, 2, GL_FLOAT, GL_FALSE, offsetof(MeshVertex, texcoord));
    attribute(4, 2, GL_FLOAT, GL_FALSE, offsetof(MeshVertex, texcoord1));
    meshes = std::make_unique<MeshBuffers>(gl, vertexArray, options.meshBudgetBytes);
}

Renderer::Impl::~Impl() {
    // A context that cannot be made current takes its objects with it when it goes.
    if (!surface.makeCurrent()) return;
    depths.reset();
    gl.DeleteVertexArrays(1, &vertexArray);
    gl.DeleteVertexArrays(1, &emptyArray);
    for (const GLuint* buffer : {&itemBuffer, &lookBuffer, &frameBuffer, &materialBuffer, &sortedBuffer}) gl.DeleteBuffers(1, buffer);
    gl.DeleteTextures(1, &materialTexture);
}

Expected<void> Renderer::Impl::begin(const Aspect& aspect, const DrawList& list, const ScreenCamera& camera,
                                     const PixelRect& rect) {
    if (auto good = checkRect(camera, rect); !good) return good;
    if (auto current = surface.makeCurrent(); !current) return current;
    scene = {.detail = list.detailed,
             .coated = list.coated,
             .samples = options.samples};
    const auto stale = shadows.begin(list.casters);
    if (!stale) return tl::unexpected(stale.error());
    for (const std::size_t view : *stale)
        if (auto drawn = drawShadows(aspect, view); !drawn) return drawn;
    collect(aspect, list, camera);
    triangles = 0;
    lightsLeftOut = list.lightsLeftOut;
    shadowsLeftOut = list.shadowsLeftOut;
    lights.clusters().setEverywhere(!options.clusterLights);
    scene.lists = lights.begin(list.lights, camera, list.casters ? shadows.texels(camera) : std::vector<std::array<float, 4>>());
    scene.environment = surroundings.begin(aspect, list.environment);
    return {};
}

void Renderer::Impl::collect(const Aspect& aspect, const DrawList& list, const ScreenCamera& camera) {
    calls.collect(aspect, list, camera, *meshes, textures);
    const auto upload = [this](GLuint buffer, const auto& values) {
        gl.NamedBufferData(buffer, static_cast<GLsizeiptr>(values.size() * sizeof(values[0])), values.data(),
                           GL_STREAM_DRAW);
    };
    if (!calls.items().empty()) {
        upload(itemBuffer, calls.items());
        upload(lookBuffer, calls.lookBlocks());
    }
    if (!calls.sortedIndices().empty()) upload(sortedBuffer, calls.sortedIndices());
    upload(materialBuffer, calls.materials());
    gl.TextureBuffer(materialTexture, GL_RGBA32F, materialBuffer);
}

/// Once for all tiles and frames that show the scene as it is now.
Expected<void> Renderer::Impl::drawShadows(const Aspect& aspect, std::size_t index) {
    const ShadowView& view = shadows.view(index);
    DrawList seen;
    seen.opaque = view.items;
    collect(aspect, seen, view.camera);
    inCell.clear();
    runs.clear();
    for (const DrawCall& call : calls.calls()) {
        const auto first = static_cast<std::uint32_t>(runs.size());
        runs.push_back({0, call.mesh.indexCount / 3});
        inCell.push_back({first, first + 1});
    }
    scissor = shadows.place(index);
    setUp(makeFrameBlock(seen, view.camera), scissor, shadows.framebuffer());
    if (auto drawn = issue(0, calls.opaqueCount(), ProgramKind::Use::kShadow); !drawn) return drawn;
    shadows.setDrawn(index);
    return {};
}

void Renderer::Impl::setUp(const FrameBlock& block, const PixelRect& viewport, GLuint framebuffer) {
    gl.NamedBufferSubData(frameBuffer, 0, sizeof block, &block);
    gl.BindBufferBase(GL_UNIFORM_BUFFER, 0, frameBuffer);
    gl.Viewport(viewport.x, viewport.y, viewport.width, viewport.height);
    gl.Enable(GL_SCISSOR_TEST);
    gl.Scissor(scissor.x, scissor.y, scissor.width, scissor.height);
    gl.ClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    gl.Enable(GL_DEPTH_TEST);
    gl.DepthFunc(GL_GREATER);
    gl.DepthMask(GL_TRUE);
    gl.Disable(GL_BLEND);
    gl.BindFramebuffer(GL_FRAMEBUFFER, surfacesNow = framebuffer);
    const float farthest = 0;
    gl.ClearNamedFramebufferfv(framebuffer, GL_DEPTH, 0, &farthest);
}

Expected<void> Renderer::Impl::beginCell(const DrawList& list, const ScreenCamera& screen, const CellPart& cell,
                                         TileBuffers& buffers) {
    scissor = grownToGrid(cell.inCell);
    if (auto room = buffers.reach(scissor.x + scissor.width, scissor.y + scissor.height); !room) return room;
    const ClusterSight sight(screen, cell.onScreen,
                             {.x = cell.onScreen.x - cell.inCell.x,
                              .y = cell.onScreen.y - cell.inCell.y,
                              .width = kCellWidthPx,
                              .height = kCellHeightPx});
    const Frustum frustum = tileFrustum(screen, cell.onScreen);
    const Frustum aroundLines = tileFrustum(screen, cell.onScreen, kFrustumMarginPx + calls.widestLineReachPx());
    inCell.clear();
    runs.clear();
    for (const DrawCall& call : calls.calls()) {
        const auto first = static_cast<std::uint32_t>(runs.size());
        const std::uint32_t all = (call.sortedCount > 0 ? call.sortedCount : call.mesh.indexCount) / 3;
        const Box& box = call.item->box;
        const Frustum& shown = call.item->lineWidth > 0 ? aroundLines : frustum;
        const Frustum::Result result = box.empty() ? Frustum::Result{} : shown.classify(box, Frustum::kAllPlanes);
        if (!result.outside && !call.item->clusters.empty() && call.sortedCount == 0)
            sight.appendRuns({.clusters = call.item->clusters,
                              .triangles = all,
                              .hidden = list.hiddenOf(*call.item),
                              .backFacesShown = calls.lookOf(call).doubleSided,
                              .reach = reachOf(box, call.item->world_T_item.translation())},
                             call.item->world_T_item, runs);
        else if (!result.outside)
            runs.push_back({0, all});
        inCell.push_back({first, static_cast<std::uint32_t>(runs.size())});
    }

    FrameBlock block = makeFrameBlock(list, cell.camera);
    block.slices = lights.beginCell(cell.camera, scissor);
    block.surroundings = surroundings.block();
    const auto [from, count] = lights.shadowed();
    const auto [pixelWidth, pixelHeight] = shadows.pixelSize();
    block.shadows = {from, count, pixelWidth, pixelHeight};
    const bool detailed = scene.detail && &buffers == &tile;
    const auto framebuffer = detailed ? buffers.detailedSurfaces() : buffers.surfaces();
    if (!framebuffer) return tl::unexpected(framebuffer.error());
    // The whole cell's viewport for every tile that shares in it; only the scissor is the tile's own.
    setUp(block, {.x = 0, .y = 0, .width = cell.camera.pixels.width, .height = cell.camera.pixels.height}, *framebuffer);
    const std::array<GLuint, 4> nothing{};
    for (GLint i = 0; i < (detailed ? 2 : 1); ++i)
        gl.ClearNamedFramebufferuiv(*framebuffer, GL_COLOR, i, nothing.data());
    return {};
}

Expected<GLuint> Renderer::Impl::program(const ProgramKind& kind) {
    auto it = programs.find(kind);
    if (it == programs.end()) {
        auto made = Program::create(gl, kind);
        if (!made) return tl::unexpected(made.error());
        it = programs.emplace(kind, std::move(*made)).first;
    }
    return it->second.name();
}

Expected<void> Renderer::Impl::useProgram(const ProgramKind& kind) {
    const auto name = program(kind);
    if (!name) return tl::unexpected(name.error());
    gl.UseProgram(*name);
    return {};
}

ProgramKind Renderer::Impl::kindOf(ProgramKind::Use use) const {
    using Use = ProgramKind::Use;
    ProgramKind kind{.use = use};
    const bool lightsSurfaces = use == Use::kLightOne || use == Use::kLight || use == Use::kLightRest;
    if (isLit(use)) {
        kind.coated = scene.coated;
        kind.lists = scene.lists;
        kind.environment = scene.environment;
    }
    if (use == Use::kSurface || use == Use::kClassify || lightsSurfaces) kind.detail = scene.detail;
    if (use != Use::kBlend && use != Use::kSurface && use != Use::kNodeIds && use != Use::kShadow && use != Use::kCopy)
        kind.samples = options.samples;
    return kind;
}

ProgramKind Renderer::Impl::kindOf(ProgramKind::Use use, const DrawCall& call) const {
    using Use = ProgramKind::Use;
    const DrawLook& look = calls.lookOf(call);
    ProgramKind kind = kindOf(use);
    kind.lines = call.item->lineWidth > 0;
    kind.masked = look.masked && use != Use::kBlend;
    if (use == Use::kNodeIds || use == Use::kShadow) {
        if (kind.masked) kind.maps = look.mapBits & bitOf(ImageMap::kBaseColor);
    } else {
        kind.maps = look.mapBits;
        kind.faceted = !call.mesh.hasNormals;
    }
    kind.look = kind.maps != 0 || kind.masked || use == Use::kBlend;
    if (use == Use::kSurface && kind.masked) kind.samples = options.samples;
    return kind;
}

/// In the list's order, whatever changes of state that costs.
Expected<void> Renderer::Impl::issue(std::size_t first, std::size_t last, ProgramKind::Use use) {
    gl.BindVertexArray(vertexArray);
    const DrawCall* before = nullptr;
    std::optional<bool> sortedBound;  // which indices the vertex array has
    ProgramKind kind;
    for (std::size_t i = first; i < last; ++i) {
        const Span& span = inCell[i];
        if (span.first == span.end) continue;
        const DrawCall& call = calls.calls()[i];
        const DrawLook& look = calls.lookOf(call);
        const ProgramKind wanted = kindOf(use, call);
        const bool another = !before || wanted != kind;
        if (another)
            if (auto used = useProgram(wanted); !used) return used;
        if (wanted.look && (!before || !kind.look || kind.maps != wanted.maps || before->look != call.look))
            bindLook(call.look, wanted.maps);
        kind = wanted;
        // What turns its back to a light stands in its way all the same.
        const bool bothSides = look.doubleSided || use == ProgramKind::Use::kShadow;
        if (!before || calls.lookOf(*before).doubleSided != look.doubleSided)
            bothSides ? gl.Disable(GL_CULL_FACE) : gl.Enable(GL_CULL_FACE);
        if (!before || before->mirrored != call.mirrored) gl.FrontFace(call.mirrored ? GL_CW : GL_CCW);
        before = &call;
        gl.BindBufferRange(GL_UNIFORM_BUFFER, 1, itemBuffer, static_cast<GLintptr>(call.block * sizeof(ItemBlock)),
                           sizeof(ItemBlock));
        const bool sorted = call.sortedCount > 0;
        if (sorted != sortedBound) gl.VertexArrayElementBuffer(vertexArray, sorted ? sortedBuffer : meshes->indexBuffer());
        sortedBound = sorted;
        const std::size_t firstIndex = sorted ? call.firstSorted : call.mesh.firstIndex;
        if (another)
            if (auto ready = prepareForOtherLights(kind); !ready) return ready;
        counts.clear();
        offsets.clear();
        for (std::uint32_t k = span.first; k < span.end; ++k) {
            counts.push_back(static_cast<GLsizei>(3 * runs[k].count));
            offsets.push_back(reinterpret_cast<const void*>(
                (firstIndex + 3 * std::size_t{runs[k].first}) * sizeof(std::uint32_t)));
            triangles += runs[k].count;
        }
        baseVertices.assign(counts.size(), call.mesh.baseVertex);
        gl.MultiDrawElementsBaseVertex(GL_TRIANGLES, counts.data(), GL_UNSIGNED_INT, offsets.data(),
                                       static_cast<GLsizei>(counts.size()), baseVertices.data());
    }
    if (sortedBound == true) gl.VertexArrayElementBuffer(vertexArray, meshes->indexBuffer());
    return {};
}

void Renderer::Impl::bindLook(std::uint32_t index, std::uint8_t maps) {
    gl.BindBufferRange(GL_UNIFORM_BUFFER, 2, lookBuffer, static_cast<GLintptr>(index * sizeof(LookBlock)),
                       sizeof(LookBlock));
    const DrawLook& look = calls.looks()[index];
    for (GLuint map = 0; map < kImageMaps; ++map) {
        if ((maps >> map & 1) == 0) continue;
        gl.BindTextureUnit(kFirstMapUnit + map, look.maps[map].texture);
        gl.BindSampler(kFirstMapUnit + map, look.maps[map].sampler);
    }
}

Expected<void> Renderer::Impl::drawOverScreen(const ProgramKind& kind) {
    if (auto used = useProgram(kind); !used) return used;
    gl.BindVertexArray(emptyArray);
    gl.Disable(GL_CULL_FACE);
    if (auto ready = prepareForOtherLights(kind); !ready) return ready;
    gl.DrawArrays(GL_TRIANGLES, 0, 3);
    return {};
}

Expected<void> Renderer::Impl::prepareForShadows(const ProgramKind& kind) {
    const ProgramKind cast = shadowOf(kind);
    if (kind.lines || !prepared.insert(cast).second) return {};
    gl.BindFramebuffer(GL_FRAMEBUFFER, shadows.framebuffer());
    gl.Scissor(0, 0, 0, 0);
    if (auto used = useProgram(cast); !used) return used;
    gl.DrawArrays(GL_TRIANGLES, 0, 3);
    gl.Scissor(scissor.x, scissor.y, scissor.width, scissor.height);
    gl.BindFramebuffer(GL_FRAMEBUFFER, surfacesNow);
    return useProgram(kind);
}

/// A software rasteriser compiles when it first draws with a state: here into an empty rectangle.
Expected<void> Renderer::Impl::prepareForOtherLights(const ProgramKind& kind) {
    if (kind.use == ProgramKind::Use::kSurface) return prepareForShadows(kind);
    if (!isLit(kind.use)) return {};
    if (!prepared.insert(otherwiseLit(kind, LightLists::kNone, false)).second) return {};
    gl.Scissor(0, 0, 0, 0);
    for (const LightLists lists : kAllLightLists) {
        for (const bool environment : {false, true}) {
            const ProgramKind other = otherwiseLit(kind, lists, environment);
            if (other == kind) continue;
            if (auto used = useProgram(other); !used) return used;
            gl.DrawArrays(GL_TRIANGLES, 0, 3);
        }
    }
    gl.Scissor(scissor.x, scissor.y, scissor.width, scissor.height);
    return useProgram(kind);
}

/// Each pixel is lit once, however many surfaces were drawn into it, and once more where its samples show different
/// ones. Where something will be blended over the picture each sample gets the colour that it shows.
Expected<void> Renderer::Impl::lightSurfaces() {
    using Use = ProgramKind::Use;
    const auto framebuffer = tile.picture();
    if (!framebuffer) return tl::unexpected(framebuffer.error());
    gl.BindFramebuffer(GL_FRAMEBUFFER, *framebuffer);
    bindSurfaces();
    gl.DepthFunc(GL_ALWAYS);
    if (auto sorted = drawOverScreen(kindOf(Use::kClassify)); !sorted) return sorted;
    gl.DepthMask(GL_FALSE);
    gl.DepthFunc(GL_EQUAL);
    if (auto lit = drawOverScreen(kindOf(Use::kLightOne)); !lit || options.samples == 1) return lit;
    gl.DepthFunc(GL_LESS);
    if (auto lit = drawOverScreen(kindOf(Use::kLight)); !lit) return lit;
    const bool perSample = blends();
    if (perSample)
        if (auto copied = copyToSamples(); !copied) return copied;
    const ProgramKind kind = kindOf(Use::kLightRest);
    bindSurfaces();
    gl.DepthFunc(GL_LESS);
    if (perSample) {
        const auto rest = tile.rest();
        if (!rest) return tl::unexpected(rest.error());
        const std::array<GLfloat, 4> nothing{};
        gl.ClearNamedFramebufferfv(*rest, GL_COLOR, 0, nothing.data());
        gl.BindFramebuffer(GL_FRAMEBUFFER, *rest);
        if (auto lit = drawOverScreen(kind); !lit) return lit;
    }
    gl.BindFramebuffer(GL_FRAMEBUFFER, *framebuffer);
    gl.Enable(GL_BLEND);
    gl.BlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ZERO, GL_ONE);
    return drawOverScreen(kind);
}

void Renderer::Impl::bindSurfaces() {
    gl.BindTextureUnit(0, tile.surfaceTexture());
    gl.BindTextureUnit(1, tile.depthTexture());
    gl.BindTextureUnit(2, materialTexture);
    if (scene.detail) gl.BindTextureUnit(kDetailUnit, tile.detailTexture());
    lights.bind(kLightUnit, kListUnit);
    surroundings.bind(kSurroundingsUnit);
    shadows.bind(kShadowUnit);
}

bool Renderer::Impl::blends() const {
    return calls.opaqueCount() < inCell.size() && inCell.back().end > inCell[calls.opaqueCount()].first;
}

Expected<void> Renderer::Impl::copyToSamples() {
    const auto framebuffer = tile.blended();
    if (!framebuffer) return tl::unexpected(framebuffer.error());
    gl.BindFramebuffer(GL_FRAMEBUFFER, *framebuffer);
    gl.BindTextureUnit(0, tile.pictureTexture());
    gl.DepthFunc(GL_ALWAYS);
    return drawOverScreen(kindOf(ProgramKind::Use::kCopy));
}

/// Alpha adds up from 0, so that it tells where anything was blended: the rest of the picture stays as it is, to the bit.
Expected<void> Renderer::Impl::blendTransparent() {
    const auto framebuffer = tile.blended();
    if (!framebuffer) return tl::unexpected(framebuffer.error());
    gl.BindFramebuffer(GL_FRAMEBUFFER, *framebuffer);
    gl.DepthMask(GL_FALSE);
    if (options.samples > 1) {
        gl.Disable(GL_BLEND);
        gl.DepthFunc(GL_ALWAYS);
        gl.BindTextureUnit(0, tile.surfaceTexture());
        gl.BindTextureUnit(1, tile.restTexture());
        if (auto spread = drawOverScreen(kindOf(ProgramKind::Use::kSpread)); !spread)
            return spread;
    }
    gl.DepthFunc(GL_GREATER);
    gl.Enable(GL_BLEND);
    gl.BlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE);
    if (auto drawn = issue(calls.opaqueCount(), calls.calls().size(), ProgramKind::Use::kBlend);
        !drawn || options.samples == 1)
        return drawn;
    gl.BindFramebuffer(GL_FRAMEBUFFER, tile.picture().value());
    gl.BindTextureUnit(0, tile.blendedTexture());
    gl.Disable(GL_BLEND);
    gl.DepthFunc(GL_ALWAYS);
    return drawOverScreen(kindOf(ProgramKind::Use::kResolve));
}

Renderer::Renderer() = default;
Renderer::~Renderer() = default;

Expected<std::unique_ptr<Renderer>> Renderer::create(Surface& surface, RendererOptions options) {
    if (options.samples != 1 && options.samples != 4)
        return fail(ErrorCode::kUnsupported, fmt::format("{} samples per pixel; 1 and 4 can be had", options.samples));
    if (auto current = surface.makeCurrent(); !current) return tl::unexpected(current.error());
    const auto gl = GlFunctions::load(surface);
    if (!gl) return failWith(surface.description(), gl.error());
    GLint alignment = 0;
    gl->GetIntegerv(GL_UNIFORM_BUFFER_OFFSET_ALIGNMENT, &alignment);
    if (alignment <= 0 || sizeof(ItemBlock) % static_cast<std::size_t>(alignment) != 0)
        return fail(ErrorCode::kUnsupported, fmt::format("the surface wants uniforms aligned to {} bytes", alignment));
    std::unique_ptr<Renderer> renderer(new Renderer);
    renderer->impl_ = std::make_unique<Impl>(surface, *gl, options);
    if (auto good = gl->check("setting up"); !good) return tl::unexpected(good.error());
    return renderer;
}

Expected<void> Renderer::Impl::drawCell(const DrawList& list, const ScreenCamera& screen, const CellPart& cell) {
    if (auto begun = beginCell(list, screen, cell, tile); !begun) return begun;
    if (auto drawn = issue(0, calls.opaqueCount(), ProgramKind::Use::kSurface); !drawn) return drawn;
    if (auto lit = lightSurfaces(); !lit) return lit;
    return blends() ? blendTransparent() : Expected<void>();
}

void Renderer::Impl::readBack(GLuint framebuffer, const CellPart& cell, const PixelRect& rect, GLenum format,
                              GLenum type, std::size_t bytesPerPixel, void* rows) {
    const auto width = static_cast<std::size_t>(rect.width);
    const auto left = static_cast<std::size_t>(cell.onScreen.x - rect.x),
               below = static_cast<std::size_t>(cell.onScreen.y - rect.y);
    gl.BindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer);
    gl.PixelStorei(GL_PACK_ALIGNMENT, 4);
    gl.PixelStorei(GL_PACK_ROW_LENGTH, rect.width);
    gl.ReadPixels(cell.inCell.x, cell.inCell.y, cell.inCell.width, cell.inCell.height, format, type,
                  static_cast<std::byte*>(rows) + bytesPerPixel * (below * width + left));
}

Expected<Picture> Renderer::draw(const Aspect& aspect, const DrawList& list, const ScreenCamera& camera,
                                 const PixelRect& rect) {
    Impl& d = *impl_;
    if (auto begun = d.begin(aspect, list, camera, rect); !begun) return tl::unexpected(begun.error());
    std::vector<std::uint8_t> rgba(4 * static_cast<std::size_t>(rect.width) * static_cast<std::size_t>(rect.height));
    for (const CellPart& cell : cellsOf(camera, rect)) {
        if (auto drawn = d.drawCell(list, camera, cell); !drawn) return tl::unexpected(drawn.error());
        d.readBack(d.tile.picture().value(), cell, rect, GL_RGBA, GL_UNSIGNED_BYTE, 4, rgba.data());
    }
    if (auto good = d.gl.check("drawing a tile"); !good) return tl::unexpected(good.error());
    return toPicture(rgba, rect.width, rect.height);
}

Expected<std::vector<std::uint64_t>> Renderer::drawNodeIds(const Aspect& aspect, const DrawList& list,
                                                           const ScreenCamera& camera, const PixelRect& rect) {
    Impl& d = *impl_;
    if (auto begun = d.begin(aspect, list, camera, rect); !begun) return tl::unexpected(begun.error());
    const auto width = static_cast<std::size_t>(rect.width);
    const auto height = static_cast<std::size_t>(rect.height);
    std::vector<std::uint32_t> words(2 * width * height);
    for (const CellPart& cell : cellsOf(camera, rect)) {
        if (auto begun = d.beginCell(list, camera, cell, d.ids); !begun) return tl::unexpected(begun.error());
        if (auto drawn = d.issue(0, d.calls.calls().size(), ProgramKind::Use::kNodeIds); !drawn)
            return tl::unexpected(drawn.error());
        d.readBack(d.ids.surfaces(), cell, rect, GL_RG_INTEGER, GL_UNSIGNED_INT, 8, words.data());
    }
    if (auto good = d.gl.check("drawing node ids"); !good) return tl::unexpected(good.error());
    std::vector<std::uint64_t> nodes(width * height);
    for (std::size_t y = 0; y < height; ++y) {
        for (std::size_t x = 0; x < width; ++x) {
            const std::size_t at = 2 * ((height - 1 - y) * width + x);
            nodes[y * width + x] = words[at] | (std::uint64_t{words[at + 1]} << 32);
        }
    }
    return nodes;
}

VisibilityDevice& Renderer::visibility(const Aspect& aspect) {
    Impl& d = *impl_;
    if (!d.depths) {
        // Where that fails, the first depth buffer says so.
        static_cast<void>(d.surface.makeCurrent());
        d.depths = std::make_unique<DepthQueries>(d.surface, d.gl, *d.meshes, d.vertexArray, d.options.samples);
    }
    d.depths->use(aspect);
    return *d.depths;
}

DrawCounts Renderer::lastCounts() const {
    DrawCounts counts = impl_->calls.counts();
    counts.triangles = impl_->triangles;
    counts.lightsLeftOut = impl_->lightsLeftOut;
    counts.shadowsLeftOut = impl_->shadowsLeftOut;
    counts.trouble = impl_->surroundings.trouble();
    counts.programs = impl_->programs.size();
    return counts;
}
std::size_t Renderer::residentBytes() const {
    return impl_->meshes->residentBytes() + impl_->textures.residentBytes();
}

std::size_t Renderer::bufferBytes() const {
    return impl_->tile.bytes() + impl_->ids.bytes() + impl_->shadows.bytes() + (impl_->depths ? impl_->depths->bytes() : 0);
}

std::uint64_t Renderer::uploadedMeshBytes() const {
    return impl_->meshes->uploadedBytes();
}

}  // namespace tessera
