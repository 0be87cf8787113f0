#include "client/draw/surface/GlState.h"

#include <utility>

namespace tessera {
namespace {

constexpr GLenum kPackInvert = 0x8758;

/// Calls `f` with the place of each bit that is set, and clears all.
template <typename F>
void forEachBit(std::uint64_t& bits, F&& f) {
    for (GLuint i = 0; bits != 0; ++i, bits >>= 1)
        if (bits & 1) f(i);
}

}  // namespace

GlState::GlState(const GlFunctions& functions) : GlFunctions(functions) {
    GetIntegerv(GL_VIEWPORT, viewport_.data());
    GetIntegerv(GL_SCISSOR_BOX, scissor_.data());
    // For good: a cube's faces go on in one another.
    GlFunctions::Enable(GL_TEXTURE_CUBE_MAP_SEAMLESS);
    // Whoever does not know it says so by an error.
    static_cast<void>(check("setting up"));
    PixelStorei(kPackInvert, 0);
    packsUpsideDown_ = check("asking for rows from the top").has_value();
}

GlState::Pixels::Pixels(GlState& state, const PixelLayout& layout) : state_(state), layout_(layout) {
    if (layout_.packRowPx > 0) state_.PixelStorei(GL_PACK_ROW_LENGTH, layout_.packRowPx);
    if (layout_.packUpsideDown) state_.PixelStorei(kPackInvert, 1);
    if (layout_.unpackBytes) state_.PixelStorei(GL_UNPACK_ALIGNMENT, 1);
}

GlState::Pixels::~Pixels() {
    if (layout_.packRowPx > 0) state_.PixelStorei(GL_PACK_ROW_LENGTH, 0);
    if (layout_.packUpsideDown) state_.PixelStorei(kPackInvert, 0);
    if (layout_.unpackBytes) state_.PixelStorei(GL_UNPACK_ALIGNMENT, 4);
}

void GlState::fill(GLuint texture, GLenum format, GLuint buffer, std::span<const std::byte> numbers) {
    // Of a buffer's size Mesa 22 takes bits 8 to 15 for a texture's last level, and 0 for one without levels.
    constexpr std::size_t kStep = 4096, kBeside = 256;
    const std::size_t size = (numbers.size() / kStep + 1) * kStep + kBeside;
    NamedBufferData(buffer, static_cast<GLsizeiptr>(size), nullptr, GL_STREAM_DRAW);
    if (!numbers.empty()) NamedBufferSubData(buffer, 0, static_cast<GLsizeiptr>(numbers.size()), numbers.data());
    TextureBuffer(texture, format, buffer);
}

void GlState::restore() {
    for (const GLenum what : {GL_SCISSOR_TEST, GL_DEPTH_TEST, GL_DEPTH_CLAMP, GL_BLEND, GL_CULL_FACE}) set(what, false);
    DepthFunc(GL_LESS);
    DepthMask(GL_TRUE);
    ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    BlendFuncSeparate(GL_ONE, GL_ZERO, GL_ONE, GL_ZERO);
    FrontFace(GL_CCW);
    ClipControl(GL_LOWER_LEFT, GL_NEGATIVE_ONE_TO_ONE);
    Viewport(viewport_[0], viewport_[1], viewport_[2], viewport_[3]);
    Scissor(scissor_[0], scissor_[1], scissor_[2], scissor_[3]);
    BindFramebuffer(GL_FRAMEBUFFER, 0);
    BindVertexArray(0);
    UseProgram(0);
    forEachBit(textured_, [this](GLuint unit) { GlFunctions::BindTextureUnit(unit, 0); });
    forEachBit(sampled_, [this](GLuint unit) { GlFunctions::BindSampler(unit, 0); });
    forEachBit(uniforms_, [this](GLuint index) { GlFunctions::BindBufferBase(GL_UNIFORM_BUFFER, index, 0); });
    forEachBit(storage_, [this](GLuint index) { GlFunctions::BindBufferBase(GL_SHADER_STORAGE_BUFFER, index, 0); });
    partsOf_.fill(0);
}

void GlState::BindTextureUnit(GLuint unit, GLuint texture) {
    TESSERA_CHECK(unit < 64, "a unit that is put back");
    textured_ |= std::uint64_t{1} << unit;
    GlFunctions::BindTextureUnit(unit, texture);
}

void GlState::BindSampler(GLuint unit, GLuint sampler) {
    TESSERA_CHECK(unit < 64, "a unit that is put back");
    sampled_ |= std::uint64_t{1} << unit;
    GlFunctions::BindSampler(unit, sampler);
}

void GlState::noteBound(GLenum target, GLuint index, GLuint partOf) {
    TESSERA_CHECK((target == GL_UNIFORM_BUFFER || target == GL_SHADER_STORAGE_BUFFER) && index < kMostBindings,
                  "a binding that is put back");
    (target == GL_UNIFORM_BUFFER ? uniforms_ : storage_) |= std::uint64_t{1} << index;
    if (target == GL_UNIFORM_BUFFER) partsOf_[index] = partOf;
}

void GlState::BindBufferBase(GLenum target, GLuint index, GLuint buffer) {
    noteBound(target, index, 0);
    GlFunctions::BindBufferBase(target, index, buffer);
}

void GlState::BindBufferRange(GLenum target, GLuint index, GLuint buffer, GLintptr offset, GLsizeiptr size) {
    noteBound(target, index, buffer);
    GlFunctions::BindBufferRange(target, index, buffer, offset, size);
}

void GlState::NamedBufferData(GLuint buffer, GLsizeiptr size, const void* data, GLenum usage) {
    for (GLuint index = 0; index < kMostBindings; ++index)
        if (partsOf_[index] == buffer) BindBufferBase(GL_UNIFORM_BUFFER, index, 0);
    GlFunctions::NamedBufferData(buffer, size, data, usage);
}

bool GlState::reserve(GLuint buffer, std::size_t bytes) {
    if (auto before = GlFunctions::check("what came before"); !before && !earlier_) earlier_ = before.error();
    NamedBufferData(buffer, static_cast<GLsizeiptr>(bytes), nullptr, GL_STATIC_DRAW);
    return GetError() == GL_NO_ERROR;
}

Expected<void> GlState::check(std::string_view what) {
    auto good = GlFunctions::check(what);
    if (const std::optional<Error> earlier = std::exchange(earlier_, std::nullopt)) return tl::unexpected(*earlier);
    return good;
}

}  // namespace tessera
