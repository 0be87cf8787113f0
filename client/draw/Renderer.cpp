#include "client/draw/Renderer.h"

#include <cmath>
#include <cstddef>
#include <map>

#include "client/draw/MeshBuffers.h"
#include "client/draw/Program.h"
#include "client/draw/RenderTarget.h"
#include "client/draw/TextureCache.h"
#include "client/draw/Tone.h"

namespace tessera {
namespace {

constexpr int kMaxSidePx = 16384;
/// A tile's scissor lies on this grid: it is the software rasteriser's own, and makes seams exact.
constexpr int kGridPx = 64;

/// The tile's rectangle grown outwards to the grid.
PixelRect grownToGrid(const PixelRect& r) {
    const int left = r.x / kGridPx * kGridPx;
    const int bottom = r.y / kGridPx * kGridPx;
    const int right = (r.x + r.width + kGridPx - 1) / kGridPx * kGridPx;
    const int top = (r.y + r.height + kGridPx - 1) / kGridPx * kGridPx;
    return {.x = left, .y = bottom, .width = right - left, .height = top - bottom};
}

Expected<void> checkRect(const ScreenCamera& camera, const PixelRect& r) {
    if (camera.pixels.width > kMaxSidePx || camera.pixels.height > kMaxSidePx)
        return fail(ErrorCode::kLimit, "a screen of more than 16384 pixels a side cannot be drawn");
    if (r.x < 0 || r.y < 0 || r.width <= 0 || r.height <= 0 || r.width > camera.pixels.width - r.x ||
        r.height > camera.pixels.height - r.y)
        return fail(ErrorCode::kBadInput, "a tile of " + std::to_string(r.width) + "x" + std::to_string(r.height) + " at " +
                                              std::to_string(r.x) + "," + std::to_string(r.y) +
                                              " does not lie on its screen of " + std::to_string(camera.pixels.width) + "x" +
                                              std::to_string(camera.pixels.height));
    return {};
}

std::array<float, 4> four(const Vec3f& v, float w) { return {v.x(), v.y(), v.z(), w}; }

/// Depth runs from 1 at the near plane to 0 at the far one: as a float it then resolves about the same relative distance
/// everywhere.
std::array<float, 16> reversedDepth(const Mat4d& clip_T_eye) {
    Mat4d m = clip_T_eye;
    m.row(2) = 0.5 * (clip_T_eye.row(3) - clip_T_eye.row(2));
    std::array<float, 16> columns{};
    for (int c = 0; c < 4; ++c)
        for (int r = 0; r < 4; ++r) columns[static_cast<std::size_t>(4 * c + r)] = static_cast<float>(m(r, c));
    return columns;
}

FrameBlock makeFrameBlock(const DrawList& list, const ScreenCamera& camera) {
    // Metres per world unit: a wall may stand in a world of any scale.
    const double scale = std::cbrt(std::abs(camera.eye_T_world.linear().determinant()));
    const Mat3d eye_R_world = camera.eye_T_world.linear() / (scale > 0 ? scale : 1.0);
    FrameBlock block{};
    block.clip_T_eye = reversedDepth(camera.clip_T_eye);
    for (int i = 0; i < 3; ++i) {
        const Vec3d row = eye_R_world.col(i);
        block.world_R_eye[static_cast<std::size_t>(i)] = four(row.cast<float>(), 0);
    }
    const std::size_t lightCount = std::min(list.lights.size(), DrawList::kMaxLights);
    block.sky = four(list.environment.sky, 0);
    block.ground = four(list.environment.ground, 0);
    for (std::size_t i = 0; i < lightCount; ++i) {
        const LightItem& light = list.lights[i];
        if (light.kind == LightItem::Kind::kDirectional) {
            const Vec3d towards = (eye_R_world * -light.direction).normalized();
            block.lights[i] = {.place = four(towards.cast<float>(), 0), .radiance = four(light.radiance, 0)};
        } else {
            const Vec3d position = camera.eye_T_world * light.position;
            const Vec3f atOneMetre = light.radiance * static_cast<float>(scale * scale);
            const float inverseRange = light.range > 0 ? static_cast<float>(1.0 / (light.range * scale)) : 0.0f;
            block.lights[i] = {.place = four(position.cast<float>(), 1), .radiance = four(atOneMetre, inverseRange)};
        }
    }
    return block;
}

DrawRecord makeRecord(const DrawItem& item, const Material& material, bool hasNormals, const ScreenCamera& camera) {
    const Affine3d eye_T_item = camera.eye_T_world * item.world_T_item;
    const Mat3d m = eye_T_item.linear();
    // The matrix of cofactors is the inverse transpose times the determinant, and exists where the inverse does not.
    Mat3d cofactors;
    cofactors.row(0) = m.row(1).cross(m.row(2));
    cofactors.row(1) = m.row(2).cross(m.row(0));
    cofactors.row(2) = m.row(0).cross(m.row(1));
    const double largest = cofactors.cwiseAbs().maxCoeff();
    if (largest > 0) cofactors /= m.determinant() < 0 ? -largest : largest;

    DrawRecord record{};
    for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) {
            record.eye_T_item[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)] = static_cast<float>(m(r, c));
            record.normalRows[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)] =
                static_cast<float>(cofactors(r, c));
        }
        record.eye_T_item[static_cast<std::size_t>(r)][3] = static_cast<float>(eye_T_item.translation()(r));
    }
    record.normalRows[0][3] = material.roughness;
    record.normalRows[1][3] = material.metallic;
    record.normalRows[2][3] = hasNormals ? 0.0f : 1.0f;
    record.baseColor = {material.baseColor.x(), material.baseColor.y(), material.baseColor.z(), material.baseColor.w()};
    record.emissive = four(material.emissive, 0);
    record.node = {static_cast<std::uint32_t>(item.node.value), static_cast<std::uint32_t>(item.node.value >> 32)};
    return record;
}

/// Something to draw, with all that its draw call needs. Its record has the same index.
struct Call {
    MeshRange mesh;
    GLuint texture = 0;
    bool doubleSided = false;
    bool mirrored = false;
};

struct LitPrograms {
    Program plain, textured;
};

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
    Impl(Surface& onSurface, GlFunctions functions, RendererOptions options, Program idProgram);
    ~Impl();

    void collect(const Aspect& aspect, const DrawList& list, const ScreenCamera& camera);
    void collect(const Aspect& aspect, const std::vector<DrawItem>& items, const ScreenCamera& camera);
    void bindFrame(const DrawList& list, const ScreenCamera& camera, GLuint framebuffer, const PixelRect& scissor);
    void issue(std::size_t first, std::size_t last, const LitPrograms* lit);
    [[nodiscard]] Expected<const LitPrograms*> litFor(std::size_t lightCount);

    Surface& surface;
    GlFunctions gl;
    Program nodeIds;
    std::map<std::size_t, LitPrograms> lit;  ///< by number of lights; a handful in the life of a wall
    GLuint vertexArray = 0, recordBuffer = 0, frameBuffer = 0;
    std::unique_ptr<MeshBuffers> meshes;
    TextureCache textures;
    RenderTarget colors, ids;

    // Of the list being drawn; kept for their memory.
    std::vector<DrawRecord> records;
    std::vector<Call> calls;
    std::size_t opaqueCalls = 0;
    DrawCounts counts;
};

Renderer::Impl::Impl(Surface& onSurface, GlFunctions functions, RendererOptions options, Program idProgram)
    : surface(onSurface),
      gl(functions),
      nodeIds(std::move(idProgram)),
      textures(gl, options.textureBudgetBytes),
      colors(gl, GL_RGBA8, options.samples),
      ids(gl, GL_RG32UI, 1) {
    gl.CreateVertexArrays(1, &vertexArray);
    gl.CreateBuffers(1, &recordBuffer);
    gl.CreateBuffers(1, &frameBuffer);
    gl.NamedBufferData(frameBuffer, sizeof(FrameBlock), nullptr, GL_STREAM_DRAW);

    const auto attribute = [&](GLuint location, GLint width, GLenum type, GLboolean normalised, std::size_t offset,
                               GLuint binding) {
        gl.EnableVertexArrayAttrib(vertexArray, location);
        gl.VertexArrayAttribFormat(vertexArray, location, width, type, normalised, static_cast<GLuint>(offset));
        gl.VertexArrayAttribBinding(vertexArray, location, binding);
    };
    attribute(0, 3, GL_FLOAT, GL_FALSE, offsetof(MeshVertex, position), 0);
    attribute(1, 3, GL_FLOAT, GL_FALSE, offsetof(MeshVertex, normal), 0);
    attribute(2, 4, GL_UNSIGNED_SHORT, GL_TRUE, offsetof(MeshVertex, color), 0);
    attribute(3, 2, GL_FLOAT, GL_FALSE, offsetof(MeshVertex, texcoord), 0);
    for (GLuint row = 0; row < 3; ++row) {
        attribute(4 + row, 4, GL_FLOAT, GL_FALSE, offsetof(DrawRecord, eye_T_item) + 16 * row, 1);
        attribute(7 + row, 4, GL_FLOAT, GL_FALSE, offsetof(DrawRecord, normalRows) + 16 * row, 1);
    }
    attribute(10, 4, GL_FLOAT, GL_FALSE, offsetof(DrawRecord, baseColor), 1);
    attribute(11, 4, GL_FLOAT, GL_FALSE, offsetof(DrawRecord, emissive), 1);
    gl.EnableVertexArrayAttrib(vertexArray, 12);
    gl.VertexArrayAttribIFormat(vertexArray, 12, 2, GL_UNSIGNED_INT, offsetof(DrawRecord, node));
    gl.VertexArrayAttribBinding(vertexArray, 12, 1);
    gl.VertexArrayBindingDivisor(vertexArray, 1, 1);
    gl.VertexArrayVertexBuffer(vertexArray, 1, recordBuffer, 0, sizeof(DrawRecord));
    meshes = std::make_unique<MeshBuffers>(gl, vertexArray, options.meshBudgetBytes);
}

Renderer::Impl::~Impl() {
    // A context that cannot be made current takes its objects with it when it goes.
    if (!surface.makeCurrent()) return;
    gl.DeleteVertexArrays(1, &vertexArray);
    gl.DeleteBuffers(1, &recordBuffer);
    gl.DeleteBuffers(1, &frameBuffer);
}

void Renderer::Impl::collect(const Aspect& aspect, const DrawList& list, const ScreenCamera& camera) {
    records.clear();
    calls.clear();
    counts = {.items = list.opaque.size() + list.transparent.size()};
    meshes->beginDraw();
    textures.beginDraw();
    collect(aspect, list.opaque, camera);
    opaqueCalls = calls.size();
    collect(aspect, list.transparent, camera);
}

void Renderer::Impl::collect(const Aspect& aspect, const std::vector<DrawItem>& items, const ScreenCamera& camera) {
    static const Material kDefaultMaterial;
    for (const DrawItem& item : items) {
        const auto* geometry = aspect.get<Geometry>(item.geometry);
        const std::optional<MeshRange> mesh = geometry ? meshes->find(*geometry) : std::nullopt;
        if (!mesh) {
            ++counts.skipped;
            continue;
        }
        if (mesh->indexCount == 0) continue;
        const auto* own = item.material ? aspect.get<Material>(item.material) : nullptr;
        const Material& material = own ? *own : kDefaultMaterial;
        Call call{.mesh = *mesh, .doubleSided = material.doubleSided != 0, .mirrored = item.mirrored};
        if (material.baseColorImage) {
            const auto* image = aspect.get<Image>(material.baseColorImage);
            call.texture = image ? textures.find(*image) : 0;
            if (call.texture == 0) ++counts.untextured;
        }
        calls.push_back(call);
        records.push_back(makeRecord(item, material, mesh->hasNormals, camera));
    }
}

void Renderer::Impl::bindFrame(const DrawList& list, const ScreenCamera& camera, GLuint framebuffer,
                               const PixelRect& scissor) {
    const FrameBlock block = makeFrameBlock(list, camera);
    gl.NamedBufferSubData(frameBuffer, 0, sizeof block, &block);
    gl.NamedBufferData(recordBuffer, static_cast<GLsizeiptr>(std::max<std::size_t>(1, records.size()) * sizeof(DrawRecord)),
                       records.empty() ? nullptr : records.data(), GL_STREAM_DRAW);
    gl.BindBufferBase(GL_UNIFORM_BUFFER, 0, frameBuffer);
    gl.BindVertexArray(vertexArray);
    gl.BindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    // The whole screen's viewport on every tile; only the scissor is the tile's own.
    gl.Viewport(0, 0, camera.pixels.width, camera.pixels.height);
    gl.Enable(GL_SCISSOR_TEST);
    gl.Scissor(scissor.x, scissor.y, scissor.width, scissor.height);
    gl.ClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    gl.Enable(GL_DEPTH_TEST);
    gl.DepthFunc(GL_GREATER);
    gl.DepthMask(GL_TRUE);
    gl.Disable(GL_BLEND);
    const float farthest = 0;
    gl.ClearNamedFramebufferfv(framebuffer, GL_DEPTH, 0, &farthest);
}

Expected<const LitPrograms*> Renderer::Impl::litFor(std::size_t lightCount) {
    if (const auto it = lit.find(lightCount); it != lit.end()) return &it->second;
    auto plain = Program::create(gl, ProgramKind::kLit, lightCount);
    if (!plain) return tl::unexpected(plain.error());
    auto textured = Program::create(gl, ProgramKind::kLitTextured, lightCount);
    if (!textured) return tl::unexpected(textured.error());
    return &lit.emplace(lightCount, LitPrograms{std::move(*plain), std::move(*textured)}).first->second;
}

void Renderer::Impl::issue(std::size_t first, std::size_t last, const LitPrograms* programs) {
    if (first == last) return;
    if (!programs) gl.UseProgram(nodeIds.name());
    const Call* before = nullptr;
    for (std::size_t i = first; i < last; ++i) {
        const Call& call = calls[i];
        if (programs && (!before || before->texture != call.texture)) {
            gl.UseProgram(call.texture ? programs->textured.name() : programs->plain.name());
            if (call.texture) gl.BindTextureUnit(0, call.texture);
        }
        if (!before || before->doubleSided != call.doubleSided)
            call.doubleSided ? gl.Disable(GL_CULL_FACE) : gl.Enable(GL_CULL_FACE);
        if (!before || before->mirrored != call.mirrored) gl.FrontFace(call.mirrored ? GL_CW : GL_CCW);
        before = &call;
        const auto* offset = reinterpret_cast<const void*>(std::size_t{call.mesh.firstIndex} * sizeof(std::uint32_t));
        gl.DrawElementsInstancedBaseVertexBaseInstance(GL_TRIANGLES, static_cast<GLsizei>(call.mesh.indexCount),
                                                       GL_UNSIGNED_INT, offset, 1, call.mesh.baseVertex,
                                                       static_cast<GLuint>(i));
    }
}

Renderer::Renderer() = default;
Renderer::~Renderer() = default;

Expected<std::unique_ptr<Renderer>> Renderer::create(Surface& surface, RendererOptions options) {
    if (options.samples != 1 && options.samples != 4)
        return fail(ErrorCode::kUnsupported, std::to_string(options.samples) + " samples per pixel; 1 and 4 can be had");
    if (auto current = surface.makeCurrent(); !current) return tl::unexpected(current.error());
    const auto gl = GlFunctions::load(surface);
    if (!gl) return failWith(surface.description(), gl.error());
    auto nodeIds = Program::create(*gl, ProgramKind::kNodeIds, 0);
    if (!nodeIds) return tl::unexpected(nodeIds.error());
    std::unique_ptr<Renderer> renderer(new Renderer);
    renderer->impl_ = std::make_unique<Impl>(surface, *gl, options, std::move(*nodeIds));
    if (auto good = gl->check("setting up"); !good) return tl::unexpected(good.error());
    return renderer;
}

Expected<Picture> Renderer::draw(const Aspect& aspect, const DrawList& list, const ScreenCamera& camera,
                                 const PixelRect& rect) {
    Impl& d = *impl_;
    if (auto good = checkRect(camera, rect); !good) return tl::unexpected(good.error());
    if (auto current = d.surface.makeCurrent(); !current) return tl::unexpected(current.error());
    const PixelRect scissor = grownToGrid(rect);
    if (auto room = d.colors.reach(scissor.x + scissor.width, scissor.y + scissor.height); !room)
        return tl::unexpected(room.error());
    const auto programs = d.litFor(std::min(list.lights.size(), DrawList::kMaxLights));
    if (!programs) return tl::unexpected(programs.error());
    d.collect(aspect, list, camera);
    d.bindFrame(list, camera, d.colors.framebuffer(), scissor);
    const std::array<float, 4> background = four(encodedColor(list.environment.background), 1);
    d.gl.ClearNamedFramebufferfv(d.colors.framebuffer(), GL_COLOR, 0, background.data());
    d.issue(0, d.opaqueCalls, *programs);
    // Seen through, in order, and hidden by what is solid.
    d.gl.DepthMask(GL_FALSE);
    d.gl.Enable(GL_BLEND);
    d.gl.BlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    d.issue(d.opaqueCalls, d.calls.size(), *programs);

    const GLuint finished = d.colors.resolve(scissor.x, scissor.y, scissor.width, scissor.height);
    std::vector<std::uint8_t> rgba(4 * static_cast<std::size_t>(rect.width) * static_cast<std::size_t>(rect.height));
    d.gl.BindFramebuffer(GL_READ_FRAMEBUFFER, finished);
    d.gl.PixelStorei(GL_PACK_ALIGNMENT, 4);
    d.gl.ReadPixels(rect.x, rect.y, rect.width, rect.height, GL_RGBA, GL_UNSIGNED_BYTE, rgba.data());
    if (auto good = d.gl.check("drawing a tile"); !good) return tl::unexpected(good.error());
    return toPicture(rgba, rect.width, rect.height);
}

Expected<std::vector<std::uint64_t>> Renderer::drawNodeIds(const Aspect& aspect, const DrawList& list,
                                                           const ScreenCamera& camera, const PixelRect& rect) {
    Impl& d = *impl_;
    if (auto good = checkRect(camera, rect); !good) return tl::unexpected(good.error());
    if (auto current = d.surface.makeCurrent(); !current) return tl::unexpected(current.error());
    const PixelRect scissor = grownToGrid(rect);
    if (auto room = d.ids.reach(scissor.x + scissor.width, scissor.y + scissor.height); !room)
        return tl::unexpected(room.error());
    d.collect(aspect, list, camera);
    d.bindFrame(list, camera, d.ids.framebuffer(), scissor);
    const std::array<GLuint, 4> nothing{};
    d.gl.ClearNamedFramebufferuiv(d.ids.framebuffer(), GL_COLOR, 0, nothing.data());
    d.issue(0, d.calls.size(), nullptr);

    const auto width = static_cast<std::size_t>(rect.width);
    const auto height = static_cast<std::size_t>(rect.height);
    std::vector<std::uint32_t> words(2 * width * height);
    d.gl.BindFramebuffer(GL_READ_FRAMEBUFFER, d.ids.framebuffer());
    d.gl.PixelStorei(GL_PACK_ALIGNMENT, 4);
    d.gl.ReadPixels(rect.x, rect.y, rect.width, rect.height, GL_RG_INTEGER, GL_UNSIGNED_INT, words.data());
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

DrawCounts Renderer::lastCounts() const { return impl_->counts; }
std::size_t Renderer::residentBytes() const { return impl_->meshes->residentBytes() + impl_->textures.residentBytes(); }

}  // namespace tessera
