#include "client/draw/passes/Renderer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <utility>

#include "client/draw/passes/RendererImpl.h"
#include "common/cores/SurfaceParts.h"

namespace tessera {

Renderer::Impl::Impl(Surface& onSurface, const GlState& state, RendererOptions o)
    : surface(onSurface),
      gl(state),
      options(o),
      textures(gl, clock,
               o.anisotropy > 0              ? o.anisotropy
               : drawsOnProcessor(onSurface) ? 1
                                             : 16),
      volumes(gl, clock, o.leaveOutEmpty),
      looks(gl),
      tile(gl, o.samples),
      ids(gl, 1),
      lights(gl),
      surroundings(gl),
      shadows(gl, options.shadowBudgetBytes),
      loops(gl, drawsOnProcessor(onSurface)) {
    gl.CreateVertexArrays(1, &vertexArray);
    gl.CreateVertexArrays(1, &emptyArray);
    for (GLuint* buffer : {&itemBuffer, &blockBuffer, &frameBuffer, &sortedBuffer}) gl.CreateBuffers(1, buffer);
    gl.NamedBufferData(frameBuffer, sizeof(FrameBlock), nullptr, GL_STREAM_DRAW);
    gl.CreateTextures(GL_TEXTURE_2D, 1, &white);
    gl.TextureStorage2D(white, 1, GL_RGBA8, 1, 1);
    constexpr std::array<std::uint8_t, 4> kWhite{255, 255, 255, 255};
    gl.TextureSubImage2D(white, 0, 0, 0, 1, 1, GL_RGBA, GL_UNSIGNED_BYTE, kWhite.data());

    const auto enable = [&](GLuint location, GLuint binding) {
        gl.EnableVertexArrayAttrib(vertexArray, location);
        gl.VertexArrayAttribBinding(vertexArray, location, binding);
    };
    const auto attribute = [&](GLuint location, GLint width, GLenum type, GLboolean normalised, std::size_t offset) {
        gl.VertexArrayAttribFormat(vertexArray, location, width, type, normalised, static_cast<GLuint>(offset));
        enable(location, kVertexBinding);
    };
    attribute(0, 3, GL_FLOAT, GL_FALSE, offsetof(MeshVertex, position));
    attribute(1, 3, GL_FLOAT, GL_FALSE, offsetof(MeshVertex, normal));
    attribute(2, 4, GL_UNSIGNED_SHORT, GL_TRUE, offsetof(MeshVertex, color));
    attribute(3, 2, GL_FLOAT, GL_FALSE, offsetof(MeshVertex, texcoord));
    attribute(4, 2, GL_FLOAT, GL_FALSE, offsetof(MeshVertex, texcoord1));
    attribute(kTangentAttribute, 4, GL_SHORT, GL_TRUE, offsetof(MappedVertex, tangent));
    for (GLuint row = 0; row < 6; ++row) {
        gl.VertexArrayAttribFormat(vertexArray, kFirstItemAttribute + row, 4, GL_FLOAT, GL_FALSE,
                                   row * 4 * sizeof(float));
        enable(kFirstItemAttribute + row, kItemBinding);
    }
    gl.VertexArrayAttribIFormat(vertexArray, kItemSize, 2, GL_UNSIGNED_INT, offsetof(ItemRecord, size));
    enable(kItemSize, kItemBinding);
    gl.VertexArrayAttribIFormat(vertexArray, kItemNode, 2, GL_UNSIGNED_INT, offsetof(ItemRecord, node));
    enable(kItemNode, kItemBinding);
    gl.VertexArrayBindingDivisor(vertexArray, kItemBinding, 1);
    const std::size_t mostOfSurface =
        drawsOnProcessor(onSurface) ? MeshBuffers::kMostOnProcessor : MeshBuffers::kMostBufferBytes;
    meshes = std::make_unique<MeshBuffers>(
        gl, clock, vertexArray, o.mostBufferBytes > 0 ? std::min(o.mostBufferBytes, mostOfSurface) : mostOfSurface);
    budget = std::make_unique<SharedBudget>(
        clock, *meshes, textures, volumes,
        SharedBudget::Own{.meshes = o.meshBudgetBytes, .textures = o.textureBudgetBytes});
    shareMemory();
}

Renderer::Impl::~Impl() {
    // A context that cannot be made current takes its objects with it when it goes.
    if (!surface.makeCurrent()) return;
    gl.restore();  // the last queries have left something
    depths.reset();
    gl.DeleteVertexArrays(1, &vertexArray);
    gl.DeleteVertexArrays(1, &emptyArray);
    for (const GLuint* buffer : {&itemBuffer, &blockBuffer, &frameBuffer, &sortedBuffer}) gl.DeleteBuffers(1, buffer);
    gl.DeleteTextures(1, &white);
}

void Renderer::Impl::shareMemory() {
    // What others take changes; asking costs some microseconds.
    constexpr unsigned kCallsEach = 64;
    if (callsSinceAsked == 0) memory = memoryForGl(gl, surface, memoryBytes());
    if (++callsSinceAsked == kCallsEach) callsSinceAsked = 0;
    if (options.memoryBytes > 0) memory.limit = options.memoryBytes;
    budget->set({.bytes = memory.limit, .others = bufferBytes(), .there = memory.there, .hard = memory.hard});
    shadows.setSpare(memory.limit - std::min(memory.limit, memoryBytes() - shadows.bytes()));
}

std::size_t Renderer::Impl::memoryBytes() const {
    return meshes->allocatedBytes() + textures.residentBytes() + volumes.residentBytes() + bufferBytes();
}

std::size_t Renderer::Impl::bufferBytes() const {
    return tile.bytes() + ids.bytes() + shadows.bytes() + (depths ? depths->bytes() : 0);
}

Renderer::Renderer() = default;
Renderer::~Renderer() = default;

Expected<std::unique_ptr<Renderer>> Renderer::create(Surface& surface, RendererOptions options) {
    if (options.samples != 1 && options.samples != 4)
        return fail(ErrorCode::kUnsupported, fmt::format("{} samples per pixel; 1 and 4 can be had", options.samples));
    if (auto current = surface.makeCurrent(); !current) return tl::unexpected(current.error());
    const auto functions = GlFunctions::load(surface);
    if (!functions) return failWith(surface.description(), functions.error());
    GlState gl(*functions);
    GLint alignment = 0;
    gl.GetIntegerv(GL_UNIFORM_BUFFER_OFFSET_ALIGNMENT, &alignment);
    if (alignment <= 0 || 256 % alignment != 0)
        return fail(ErrorCode::kUnsupported, fmt::format("the surface wants uniforms aligned to {} bytes", alignment));
    std::unique_ptr<Renderer> renderer(new Renderer);
    renderer->impl_ = std::make_unique<Impl>(surface, gl, options);
    renderer->impl_->calls.callAtEach(options.onStep);
    if (auto good = gl.check("setting up"); !good) return tl::unexpected(good.error());
    return renderer;
}

void Renderer::Impl::readBack(GLuint framebuffer, const CellPart& cell, const PixelRect& rect, GLenum format,
                              GLenum type, std::size_t bytesPerPixel, void* rows) {
    const auto width = static_cast<std::size_t>(rect.width);
    const auto left = static_cast<std::size_t>(cell.onScreen.x - rect.x),
               below = static_cast<std::size_t>(cell.onScreen.y - rect.y);
    gl.BindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer);
    const GlState::Pixels layout(gl, {.packRowPx = rect.width});
    gl.ReadPixels(cell.inCell.x, cell.inCell.y, cell.inCell.width, cell.inCell.height, format, type,
                  static_cast<std::byte*>(rows) + bytesPerPixel * (below * width + left));
}

void Renderer::Impl::readColors(const CellPart& cell, const PixelRect& rect, const PixelRows& rows) {
    const PixelRect& from = cell.inCell;
    const int fromTop = rect.y + rect.height - (cell.onScreen.y + from.height);
    std::uint8_t* const to = rows.rgbx + rows.pitchBytes * static_cast<std::size_t>(fromTop) +
                             4 * static_cast<std::size_t>(cell.onScreen.x - rect.x);
    gl.BindFramebuffer(GL_READ_FRAMEBUFFER, tile.picture().value());
    const bool invert = gl.packsUpsideDown();
    const GlState::Pixels layout(gl, {.packRowPx = static_cast<int>(rows.pitchBytes / 4), .packUpsideDown = invert});
    gl.ReadPixels(from.x, from.y, from.width, from.height, GL_RGBA, GL_UNSIGNED_BYTE, to);
    if (invert) return;
    const auto row = [&](int y) { return to + rows.pitchBytes * static_cast<std::size_t>(y); };
    for (int y = 0; 2 * y < from.height - 1; ++y)
        std::swap_ranges(row(y), row(y) + 4 * static_cast<std::size_t>(from.width), row(from.height - 1 - y));
}

Expected<void> Renderer::Impl::goOn() {
    if (options.onStep) options.onStep();
    if (!unwanted || !(leftOff = leftOff || (*unwanted)())) return {};
    return fail(ErrorCode::kRefused, "nobody wants this picture any more");
}

Expected<void> Renderer::Impl::drawCells(const DrawList& list, const ScreenCamera& camera, const PixelRect& rect,
                                         const PixelRows& rows) {
    readBackTime = {};
    for (const CellPart& cell : cellsOf(camera, rect)) {
        if (auto drawn = drawCell(list, camera, cell); !drawn) return drawn;
        gl.Finish();  // what comes now would wait for it
        if (auto wanted = goOn(); !wanted) return wanted;
        const TimePoint finished = options.time->now();
        readColors(cell, rect, rows);
        readBackTime += options.time->now() - finished;
    }
    return gl.check("drawing a tile");
}

Expected<void> Renderer::drawInto(const Aspect& aspect, const DrawList& list, const ScreenCamera& camera,
                                  const PixelRect& rect, const PixelRows& rows) {
    if (auto current = impl_->surface.makeCurrent(); !current) return current;
    const GlState::Call call(impl_->gl);
    TESSERA_CHECK(rows.pitchBytes % 4 == 0 && rows.pitchBytes >= 4 * static_cast<std::size_t>(rect.width),
                  "rows have room for the rectangle");
    return impl_->drawInTime([&]() -> Expected<void> {
        if (auto begun = impl_->begin(aspect, list, camera, rect); !begun) return begun;
        return impl_->drawCells(list, camera, rect, rows);
    });
}

Expected<Picture> Renderer::draw(const Aspect& aspect, const DrawList& list, const ScreenCamera& camera,
                                 const PixelRect& rect) {
    if (auto current = impl_->surface.makeCurrent(); !current) return tl::unexpected(current.error());
    const GlState::Call call(impl_->gl);
    std::size_t pixels = 0;
    std::vector<std::uint8_t>& rgbx = impl_->rgbx;
    const auto drawn = impl_->drawInTime([&]() -> Expected<void> {
        if (auto begun = impl_->begin(aspect, list, camera, rect); !begun) return begun;
        pixels = static_cast<std::size_t>(rect.width) * static_cast<std::size_t>(rect.height);
        rgbx.resize(std::max(rgbx.size(), 4 * pixels));
        return impl_->drawCells(list, camera, rect,
                                {.rgbx = rgbx.data(), .pitchBytes = 4 * static_cast<std::size_t>(rect.width)});
    });
    if (!drawn) return tl::unexpected(drawn.error());
    Picture picture{.widthPx = rect.width, .heightPx = rect.height, .rgb = {}};
    picture.rgb.resize(3 * pixels);
    dropAlpha(rgbx.data(), pixels, picture.rgb.data());
    return picture;
}

Expected<std::optional<Picture>> Renderer::drawWhileWanted(const Aspect& aspect, const DrawList& list,
                                                           const ScreenCamera& camera, const PixelRect& rect,
                                                           const std::function<bool()>& unwanted) {
    impl_->unwanted = &unwanted;
    impl_->leftOff = false;
    const Impl::ByProgram ownFrame = std::exchange(impl_->loopsTookBefore, {});
    const bool ownShared = std::exchange(impl_->shared, false);
    auto picture = draw(aspect, list, camera, rect);
    impl_->loopsTookBefore = ownFrame;
    impl_->shared = ownShared;
    impl_->unwanted = nullptr;
    if (impl_->leftOff) return std::nullopt;
    if (!picture) return tl::unexpected(picture.error());
    return std::move(*picture);
}

Expected<std::vector<std::uint64_t>> Renderer::drawNodeIds(const Aspect& aspect, const DrawList& list,
                                                           const ScreenCamera& camera, const PixelRect& rect) {
    Impl& d = *impl_;
    if (auto current = d.surface.makeCurrent(); !current) return tl::unexpected(current.error());
    const GlState::Call call(d.gl);
    std::size_t width = 0, height = 0;
    std::vector<std::uint32_t> words;
    const auto drawn = d.drawInTime([&]() -> Expected<void> {
        if (auto begun = d.begin(aspect, list, camera, rect); !begun) return begun;
        width = static_cast<std::size_t>(rect.width);
        height = static_cast<std::size_t>(rect.height);
        words.resize(2 * width * height);
        for (const CellPart& cell : cellsOf(camera, rect)) {
            if (auto begun = d.beginCell(list, camera, cell, d.ids); !begun) return begun;
            if (auto issued = d.issue(0, d.calls.calls().size(), ProgramKind::Use::kNodeIds); !issued) return issued;
            d.readBack(d.ids.surfaces(), cell, rect, GL_RG_INTEGER, GL_UNSIGNED_INT, 8, words.data());
        }
        return {};
    });
    if (!drawn) return tl::unexpected(drawn.error());
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

std::vector<HeldUpBy> Renderer::heldUpBy(const Aspect& aspect) {
    const std::uint64_t before = programChanges();
    std::vector<HeldUpBy> all = impl_->looks.persons().heldUpBy(aspect);
    // One is drawn with again: maps lack what it makes of things.
    if (programChanges() != before) impl_->shadows.forget();
    return all;
}

std::uint64_t Renderer::programChanges() const {
    return impl_->looks.persons().verdicts();
}

VisibilityDevice& Renderer::visibility() {
    Impl& d = *impl_;
    if (!d.depths) {
        // Where that fails, the first depth buffer says so.
        static_cast<void>(d.surface.makeCurrent());
        d.depths =
            std::make_unique<DepthQueries>(d.surface, d.gl, *d.meshes, *d.budget, d.vertexArray, d.options.samples);
    }
    return *d.depths;
}

DrawCounts Renderer::lastCounts() const {
    DrawCounts counts = impl_->calls.counts();
    counts.triangles = impl_->triangles;
    counts.pixels = impl_->pixels;
    counts.glCalls = impl_->glCalls;
    counts.looksUploaded = impl_->looksUploaded;
    counts.memoryBytes = impl_->memoryBytes();
    counts.memoryBudget = impl_->memory.limit;
    counts.bufferCopies = impl_->meshes->copies();
    counts.lightsPrepared = impl_->lights.prepared();
    counts.states = impl_->states;
    counts.lightsLeftOut = impl_->lightsLeftOut;
    counts.shadowsLeftOut = impl_->shadowsLeftOut;
    counts.scopesLeftOut = impl_->scopesLeftOut;
    counts.trouble = impl_->surroundings.trouble();
    if (!counts.trouble.empty()) counts.trouble += "; sky and ground stand in";
    if (counts.trouble.empty()) counts.trouble = impl_->looks.persons().trouble();
    counts.programs = impl_->programs.size();
    counts.compiled = impl_->compiled;
    counts.readBack = impl_->readBackTime;
    return counts;
}

LightHistogram Renderer::lastLight(std::span<const PixelRect> elsewhere) const {
    LightHistogram light;
    for (const Impl::MeteredCell& cell : impl_->metered)
        for (int row = 0; row < cell.rows; ++row)
            for (int column = 0; column < cell.columns; ++column) {
                constexpr int kSide = LightHistogram::kSquarePx, kPlace = LightHistogram::kPlaceInSquare;
                const int x = kSide * (cell.left + column) + kPlace, y = kSide * (cell.bottom + row) + kPlace;
                const bool others = std::ranges::any_of(elsewhere, [&](const PixelRect& rect) {
                    return x >= rect.x && x < rect.x + rect.width && y >= rect.y && y < rect.y + rect.height;
                });
                if (others) continue;
                const std::size_t at = static_cast<std::size_t>(row) * cell.pitch + static_cast<std::size_t>(column);
                ++light.pixels[cell.classes[at]];
            }
    return light;
}

std::size_t Renderer::residentBytes() const {
    return impl_->meshes->residentBytes() + impl_->textures.residentBytes() + impl_->volumes.residentBytes();
}

std::size_t Renderer::bufferBytes() const {
    return impl_->bufferBytes();
}

std::uint64_t Renderer::uploadedMeshBytes() const {
    return impl_->meshes->uploadedBytes();
}

std::uint64_t Renderer::uploadedTextureBytes() const {
    return impl_->textures.uploadedBytes() + impl_->volumes.uploadedBytes();
}

void Renderer::beginFrame() {
    impl_->shadows.beginFrame();
    if (impl_->clock.beginFrame())
        impl_->rests = false;
    else if (!std::exchange(impl_->rests, true) && impl_->surface.makeCurrent()) {
        const GlState::Call call(impl_->gl);
        impl_->shareMemory();
        impl_->budget->rest();
    }
    impl_->looks.persons().beginFrame();
    impl_->loopsTookBefore.clear();
    impl_->shared = false;
    impl_->framesAreTold = true;
}

Expected<Renderer::Prepared> Renderer::prepare(const Aspect& aspect, const SceneContent& content, std::size_t bytes) {
    Impl& d = *impl_;
    if (auto current = d.surface.makeCurrent(); !current) return tl::unexpected(current.error());
    const GlState::Call call(d.gl);
    d.shareMemory();
    Prepared prepared;
    const auto add = [&](const std::optional<std::size_t>& uploaded) {
        prepared.bytes += uploaded.value_or(0);
        prepared.full = prepared.full || !uploaded;
    };
    add(d.meshes->prepare(*content.mesh, normalMapOf(aspect, content.material), bytes));
    // Voxels of what has a box or planes: its fields have been checked.
    const auto* volume =
        prepared.bytes == 0 && rowOf(content.mesh->arrays.kind).volume ? aspect.get<Volume>(content.geometry) : nullptr;
    if (volume && !content.mesh->arrays.positions.empty()) add(d.volumes.prepare(*volume, bytes));
    const auto* material = content.material ? aspect.get<Material>(content.material) : nullptr;
    if (material && prepared.bytes == 0)
        for (const auto& [imageId, use] : imagesOf(*material)) {
            const auto* image = imageId && prepared.bytes == 0 ? aspect.get<Image>(imageId) : nullptr;
            if (image) add(d.textures.prepare(*image, use));
        }
    if (material && prepared.bytes == 0)
        for (const ObjectId layerId : material->layers) {
            const auto* layer = aspect.get<TextureLayer>(layerId);
            const auto* image =
                layer && layer->image && prepared.bytes == 0 ? aspect.get<Image>(layer->image) : nullptr;
            if (image) add(d.textures.prepare(*image, ImageUse::kColor));
        }
    if (auto good = d.gl.check("uploading ahead"); !good) return tl::unexpected(good.error());
    return prepared;
}

Expected<void> Renderer::expectMeshes(const MeshSize& more) {
    if (auto current = impl_->surface.makeCurrent(); !current) return current;
    const GlState::Call call(impl_->gl);
    impl_->shareMemory();
    impl_->meshes->expect(more);
    return impl_->gl.check("making room ahead");
}

}  // namespace tessera
