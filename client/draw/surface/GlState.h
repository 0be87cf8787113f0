/// What GL keeps from one call to the next: set here alone, and put back.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "client/draw/surface/GlFunctions.h"

namespace tessera {

/// GL's functions with those that set something which lasts: pixel stores, bindings, masks, tests, programs. They are
/// the same as GL's, and note what is to be put back. One for each context; whoever draws, uploads or reads has a
/// reference.
///
/// Whoever is called from outside begins a `Call`: all is as GL has it at first, then, and is again when it ends. So no
/// picture depends on what was drawn, read or uploaded before. DepthQueries, which is asked many small things in a row,
/// begins one without an end: what it leaves the next Call clears.
class GlState : public GlFunctions {
public:
    GlState() = default;
    /// The surface is current.
    explicit GlState(const GlFunctions& functions);

    class Call {
    public:
        explicit Call(GlState& state) : state_(state) {
            if (state_.calls_++ == 0) state_.restore();
        }
        ~Call() {
            if (--state_.calls_ == 0) state_.restore();
        }
        Call(const Call&) = delete;
        Call& operator=(const Call&) = delete;

    private:
        GlState& state_;
    };

    /// How pixels lie in memory while it lives; one at a time.
    struct PixelLayout {
        int packRowPx = 0;            ///< 0: as wide as what is read
        bool packUpsideDown = false;  ///< GL_MESA_pack_invert: only where `packsUpsideDown`
        bool unpackBytes = false;     ///< rows begin at any byte; else at multiples of four
    };
    class Pixels {
    public:
        Pixels(GlState& state, const PixelLayout& layout);
        ~Pixels();
        Pixels(const Pixels&) = delete;
        Pixels& operator=(const Pixels&) = delete;

    private:
        GlState& state_;
        PixelLayout layout_;
    };
    /// Mesa can turn rows upside down while it copies them.
    [[nodiscard]] bool packsUpsideDown() const { return packsUpsideDown_; }

    /// What a texture of numbers has from here on, of its buffer. llvmpipe compiles a program anew for textures whose
    /// sides are powers of two, and for buffers that are small: these are always neither, however much is in them.
    void fill(GLuint texture, GLenum format, GLuint buffer, std::span<const std::byte> numbers);

    /// As GL has it at first.
    void restore();

    void Enable(GLenum what) { set(what, true); }
    void Disable(GLenum what) { set(what, false); }
    void DepthFunc(GLenum function) { GlFunctions::DepthFunc(function); }
    void DepthMask(GLboolean writes) { GlFunctions::DepthMask(writes); }
    void ColorMask(GLboolean r, GLboolean g, GLboolean b, GLboolean a) { GlFunctions::ColorMask(r, g, b, a); }
    void BlendFuncSeparate(GLenum source, GLenum to, GLenum sourceAlpha, GLenum toAlpha) {
        GlFunctions::BlendFuncSeparate(source, to, sourceAlpha, toAlpha);
    }
    void FrontFace(GLenum front) { GlFunctions::FrontFace(front); }
    void ClipControl(GLenum origin, GLenum depth) { GlFunctions::ClipControl(origin, depth); }
    void Viewport(GLint x, GLint y, GLsizei width, GLsizei height) { GlFunctions::Viewport(x, y, width, height); }
    void Scissor(GLint x, GLint y, GLsizei width, GLsizei height) { GlFunctions::Scissor(x, y, width, height); }
    void BindFramebuffer(GLenum target, GLuint framebuffer) { GlFunctions::BindFramebuffer(target, framebuffer); }
    void BindVertexArray(GLuint array) { GlFunctions::BindVertexArray(array); }
    void UseProgram(GLuint program) { GlFunctions::UseProgram(program); }
    void BindTextureUnit(GLuint unit, GLuint texture);
    void BindSampler(GLuint unit, GLuint sampler);
    /// Of uniforms, or storage.
    void BindBufferBase(GLenum target, GLuint index, GLuint buffer);
    void BindBufferRange(GLenum target, GLuint index, GLuint buffer, GLintptr offset, GLsizeiptr size);
    /// Where parts of the buffer are bound as uniforms nothing is afterwards: what it holds now may end before them,
    /// and llvmpipe (Mesa 22.3.6) copies what is bound whether a program reads it or not.
    void NamedBufferData(GLuint buffer, GLsizeiptr size, const void* data, GLenum usage);
    /// The same without data, for good. False: GL has no memory for it. That is no error of which `check` tells.
    [[nodiscard]] bool reserve(GLuint buffer, std::size_t bytes);
    /// As GlFunctions::check.
    [[nodiscard]] Expected<void> check(std::string_view what);

private:
    static constexpr std::size_t kMostBindings = 64;
    void noteBound(GLenum target, GLuint index, GLuint partOf);
    void set(GLenum what, bool enabled) { enabled ? GlFunctions::Enable(what) : GlFunctions::Disable(what); }

    std::uint64_t textured_ = 0, sampled_ = 0;     ///< units that have something: a bit each
    std::uint64_t uniforms_ = 0, storage_ = 0;     ///< the same of buffers
    std::array<GLuint, kMostBindings> partsOf_{};  ///< of uniforms: the buffer of which a part is bound; 0: of none
    std::array<GLint, 4> viewport_{}, scissor_{};  ///< at first
    bool packsUpsideDown_ = false;
    std::optional<Error> earlier_;  ///< from before the last `reserve`
    int calls_ = 0;
};

}  // namespace tessera
