#include "client/draw/passes/DepthQueries.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "client/draw/passes/DrawCalls.h"
#include "client/draw/passes/ScreenCells.h"
#include "common/wall/Detail.h"

namespace tessera {

DepthQueries::DepthQueries(Surface& surface, GlState& gl, MeshBuffers& meshes, SharedBudget& budget, GLuint meshArray,
                           int samples)
    : surface_(surface),
      gl_(gl),
      meshes_(meshes),
      budget_(budget),
      meshArray_(meshArray),
      mostSamples_(samples),
      samples_(samples) {
    gl_.CreateVertexArrays(1, &plateArray_);
    gl_.CreateVertexArrays(1, &emptyArray_);
    for (GLuint* buffer : {&plateBuffer_, &itemBuffer_, &frameBuffer_}) gl_.CreateBuffers(1, buffer);
    gl_.EnableVertexArrayAttrib(plateArray_, 0);
    gl_.VertexArrayAttribFormat(plateArray_, 0, 3, GL_FLOAT, GL_FALSE, 0);
    gl_.VertexArrayAttribBinding(plateArray_, 0, 0);
    gl_.VertexArrayVertexBuffer(plateArray_, 0, plateBuffer_, 0, sizeof(corners_[0]));
}

DepthQueries::~DepthQueries() {
    // A context that cannot be made current takes its objects with it when it goes.
    if (!surface_.makeCurrent()) return;
    destroyBuffers();
    gl_.DeleteVertexArrays(1, &plateArray_);
    gl_.DeleteVertexArrays(1, &emptyArray_);
    for (const GLuint* buffer : {&plateBuffer_, &itemBuffer_, &frameBuffer_}) gl_.DeleteBuffers(1, buffer);
    if (!queries_.empty()) gl_.DeleteQueries(static_cast<GLsizei>(queries_.size()), queries_.data());
}

std::vector<VisibilityDevice::Part> DepthQueries::partsOf(const ScreenCamera& screen, const PixelRect& rect) const {
    std::vector<Part> parts;
    for (const CellPart& cell : cellsOf(screen, rect)) parts.push_back({cell.camera, cell.inCell});
    return parts;
}

Expected<void> DepthQueries::begin(const Part& part) {
    if (auto current = surface_.makeCurrent(); !current) return current;
    gl_.restore();
    budget_.beginDepths();
    const PixelRect& pixels = part.pixels;
    if (const int samples = std::min(mostSamples_, detailStep(part.camera.detail).mostSamples);
        std::exchange(samples_, samples) != samples) {
        destroyBuffers();
        widthPx_ = heightPx_ = 0;
    }
    if (auto room = reach(pixels.x + pixels.width, pixels.y + pixels.height); !room) return room;
    part_ = part;
    asked_ = 0;
    const FrameBlock block = makeFrameBlock({}, part.camera);
    gl_.NamedBufferData(frameBuffer_, sizeof block, &block, GL_STREAM_DRAW);
    gl_.Viewport(0, 0, part.camera.pixels.width, part.camera.pixels.height);
    gl_.Enable(GL_SCISSOR_TEST);
    gl_.Scissor(pixels.x, pixels.y, pixels.width, pixels.height);
    gl_.ClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    gl_.Enable(GL_DEPTH_TEST);
    gl_.DepthMask(GL_TRUE);
    gl_.Disable(GL_BLEND);
    gl_.BindFramebuffer(GL_FRAMEBUFFER, depthFramebuffer_);
    const float nothing = 0;
    gl_.ClearNamedFramebufferfv(depthFramebuffer_, GL_DEPTH, 0, &nothing);
    return gl_.check("clearing depths");
}

Expected<void> DepthQueries::drawDepth(std::span<const DrawItem> items) {
    calls_.clear();
    for (const DrawItem& item : items) {
        const LookSource* source = item.look ? item.look->levels.front().own.look.get() : nullptr;
        const MeshRange* mesh = item.mesh ? meshes_.find(*item.mesh, Material::kFilled, normalMapOf(source)) : nullptr;
        if (!mesh || mesh->kind != item.kind || mesh->indexCount == 0) continue;
        const bool balls = formOf(item.kind).balls;
        calls_.push_back({*mesh, item.mirrored && !balls, source && source->doubleSided, &item});
        if (balls && isStretched(item.world_T_item.linear())) calls_.back().mesh.pointParts |= kPointStretched;
    }
    if (calls_.empty()) return {};
    // Depths are the same in any order: instances of one mesh stand together.
    std::stable_sort(calls_.begin(), calls_.end(), [](const Call& a, const Call& b) { return a.state() < b.state(); });
    drawn_.clear();
    for (const Call& call : calls_) drawn_.push_back(call.item);
    recordMaker_.make(drawn_, part_->camera, records_);
    gl_.NamedBufferData(itemBuffer_, static_cast<GLsizeiptr>(records_.size() * sizeof(ItemRecord)), records_.data(),
                        GL_STREAM_DRAW);
    gl_.VertexArrayVertexBuffer(meshArray_, kItemBinding, itemBuffer_, 0, sizeof(ItemRecord));
    gl_.BindFramebuffer(GL_FRAMEBUFFER, depthFramebuffer_);
    gl_.BindBufferBase(GL_UNIFORM_BUFFER, 0, frameBuffer_);
    gl_.BindVertexArray(meshArray_);
    gl_.DepthFunc(GL_GREATER);
    gl_.DepthMask(GL_TRUE);
    for (std::size_t i = 0, next = 0; i < calls_.size(); i = next) {
        const Call& call = calls_[i];
        for (next = i + 1; next < calls_.size() && calls_[next].state() == call.state();) ++next;
        const MeshRange* before = i > 0 ? &calls_[i - 1].mesh : nullptr;
        if (!before || before->kind != call.mesh.kind || before->pointParts != call.mesh.pointParts)
            if (auto used = useProgram({.use = ProgramKind::Use::kDepth,
                                        .items = call.mesh.kind,
                                        .pointParts = call.mesh.pointParts,
                                        .samples = samples_});
                !used)
                return used;
        call.doubleSided ? gl_.Disable(GL_CULL_FACE) : gl_.Enable(GL_CULL_FACE);
        gl_.FrontFace(call.mirrored ? GL_CW : GL_CCW);
        meshes_.draw(call.mesh, 0, call.mesh.indexCount / 3, i, next - i, call.doubleSided);
    }
    return gl_.check("drawing depths");
}

Expected<VisibilityDevice::Ticket> DepthQueries::ask(std::span<const Plate> plates,
                                                     std::span<const std::uint32_t> sizes) {
    const std::size_t first = asked_;
    asked_ += sizes.size();
    if (asked_ > queries_.size()) {
        const std::size_t known = queries_.size();
        queries_.resize(2 * asked_);
        gl_.CreateQueries(GL_ANY_SAMPLES_PASSED, static_cast<GLsizei>(queries_.size() - known), &queries_[known]);
    }
    // Whole pixels of a cell, whose sizes have few bits: the corners are those very numbers, within a thousandth of a
    // pixel.
    const auto x = [&](int px) {
        return static_cast<float>(2.0 * (part_->pixels.x + px) / part_->camera.pixels.width - 1);
    };
    const auto y = [&](int px) {
        return static_cast<float>(2.0 * (part_->pixels.y + px) / part_->camera.pixels.height - 1);
    };
    corners_.clear();
    for (const Plate& p : plates) {
        const float left = x(p.left), right = x(p.right), bottom = y(p.bottom), top = y(p.top);
        const std::array<std::array<float, 3>, 6> two = {{{left, bottom, p.depth},
                                                          {right, bottom, p.depth},
                                                          {right, top, p.depth},
                                                          {left, bottom, p.depth},
                                                          {right, top, p.depth},
                                                          {left, top, p.depth}}};
        corners_.insert(corners_.end(), two.begin(), two.end());
    }
    gl_.NamedBufferData(plateBuffer_, static_cast<GLsizeiptr>(corners_.size() * sizeof(corners_[0])), corners_.data(),
                        GL_STREAM_DRAW);
    if (auto used = useProgram({.use = ProgramKind::Use::kPlates}); !used) return tl::unexpected(used.error());
    gl_.BindFramebuffer(GL_FRAMEBUFFER, depthFramebuffer_);
    gl_.BindVertexArray(plateArray_);
    gl_.Disable(GL_CULL_FACE);
    gl_.DepthFunc(GL_GEQUAL);
    gl_.DepthMask(GL_FALSE);
    std::size_t plate = 0;
    for (std::size_t i = 0; i < sizes.size(); ++i) {
        gl_.BeginQuery(GL_ANY_SAMPLES_PASSED, queries_[first + i]);
        gl_.DrawArrays(GL_TRIANGLES, static_cast<GLint>(6 * plate), static_cast<GLsizei>(6 * sizes[i]));
        gl_.EndQuery(GL_ANY_SAMPLES_PASSED);
        plate += sizes[i];
    }
    if (auto good = gl_.check("asking what is hidden"); !good) return tl::unexpected(good.error());
    return static_cast<Ticket>(first);
}

Expected<bool> DepthQueries::answer(Ticket ticket) {
    TESSERA_CHECK(ticket < asked_, "this was not asked");
    GLuint any = 1;
    gl_.GetQueryObjectuiv(queries_[ticket], GL_QUERY_RESULT, &any);
    return any != 0;
}

Expected<std::span<const float>> DepthQueries::farthest() {
    const PixelRect& pixels = part_->pixels;
    read_.resize(static_cast<std::size_t>(pixels.width) * static_cast<std::size_t>(pixels.height));
    if (samples_ > 1)
        if (auto gathered = gatherSamples(); !gathered) return tl::unexpected(gathered.error());
    gl_.BindFramebuffer(GL_READ_FRAMEBUFFER, samples_ > 1 ? farthestFramebuffer_ : depthFramebuffer_);
    gl_.ReadPixels(pixels.x, pixels.y, pixels.width, pixels.height, samples_ > 1 ? GL_RED : GL_DEPTH_COMPONENT,
                   GL_FLOAT, read_.data());
    if (auto good = gl_.check("reading depths"); !good) return tl::unexpected(good.error());
    return std::span<const float>(read_);
}

Expected<void> DepthQueries::gatherSamples() {
    if (auto used = useProgram({.use = ProgramKind::Use::kFarthest}); !used) return used;
    gl_.BindFramebuffer(GL_FRAMEBUFFER, farthestFramebuffer_);
    gl_.BindTextureUnit(0, depth_);
    gl_.BindVertexArray(emptyArray_);
    gl_.Disable(GL_CULL_FACE);
    gl_.Disable(GL_DEPTH_TEST);
    gl_.DrawArrays(GL_TRIANGLES, 0, 3);
    gl_.Enable(GL_DEPTH_TEST);
    return {};
}

Expected<void> DepthQueries::useProgram(const ProgramKind& kind) {
    auto it = programs_.find(kind);
    if (it == programs_.end()) {
        ProgramKind sampled = kind;
        sampled.samples = samples_;
        auto made = Program::create(gl_, sampled);
        if (!made) return tl::unexpected(made.error());
        it = programs_.emplace(kind, std::move(*made)).first;
    }
    gl_.UseProgram(it->second.name());
    meshes_.bindFor(kind.items);
    return {};
}

Expected<void> DepthQueries::reach(int widthPx, int heightPx) {
    if (widthPx <= widthPx_ && heightPx <= heightPx_) return {};
    widthPx_ = std::max(widthPx, widthPx_);
    heightPx_ = std::max(heightPx, heightPx_);
    // Rows a power of two apart fall into the same cache sets.
    if (widthPx_ % 512 == 0) widthPx_ += 64;
    destroyBuffers();
    gl_.CreateFramebuffers(1, &depthFramebuffer_);
    if (samples_ > 1) {
        gl_.CreateTextures(GL_TEXTURE_2D_MULTISAMPLE, 1, &depth_);
        gl_.TextureStorage2DMultisample(depth_, samples_, GL_DEPTH_COMPONENT32F, widthPx_, heightPx_, GL_TRUE);
        gl_.CreateTextures(GL_TEXTURE_2D, 1, &farthest_);
        gl_.TextureStorage2D(farthest_, 1, GL_R32F, widthPx_, heightPx_);
        gl_.CreateFramebuffers(1, &farthestFramebuffer_);
        gl_.NamedFramebufferTexture(farthestFramebuffer_, GL_COLOR_ATTACHMENT0, farthest_, 0);
        if (auto good = checkFramebuffer(farthestFramebuffer_); !good) return good;
    } else {
        gl_.CreateTextures(GL_TEXTURE_2D, 1, &depth_);
        gl_.TextureStorage2D(depth_, 1, GL_DEPTH_COMPONENT32F, widthPx_, heightPx_);
    }
    gl_.NamedFramebufferTexture(depthFramebuffer_, GL_DEPTH_ATTACHMENT, depth_, 0);
    const GLenum none = GL_NONE;
    gl_.NamedFramebufferDrawBuffers(depthFramebuffer_, 1, &none);
    return checkFramebuffer(depthFramebuffer_);
}

Expected<void> DepthQueries::checkFramebuffer(GLuint framebuffer) const {
    if (auto good = gl_.check("making a depth buffer"); !good) return good;
    if (gl_.CheckNamedFramebufferStatus(framebuffer, GL_DRAW_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE) return {};
    return fail(ErrorCode::kUnsupported, fmt::format("the surface cannot draw depths into {}x{} with {} samples",
                                                     widthPx_, heightPx_, samples_));
}

void DepthQueries::destroyBuffers() {
    for (GLuint* framebuffer : {&depthFramebuffer_, &farthestFramebuffer_}) {
        if (*framebuffer) gl_.DeleteFramebuffers(1, framebuffer);
        *framebuffer = 0;
    }
    for (GLuint* texture : {&depth_, &farthest_}) {
        if (*texture) gl_.DeleteTextures(1, texture);
        *texture = 0;
    }
}

std::size_t DepthQueries::bytes() const {
    if (!depth_) return 0;
    return static_cast<std::size_t>(widthPx_) * static_cast<std::size_t>(heightPx_) *
           (4 * static_cast<std::size_t>(samples_) + (farthest_ ? 4 : 0));
}

}  // namespace tessera
