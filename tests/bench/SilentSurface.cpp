#include "tests/bench/SilentSurface.h"

#include <array>
#include <cstring>
#include <string_view>
#include <utility>

#include "client/draw/surface/GlFunctions.h"

namespace tessera::bench {
namespace {

SilentUploads uploaded;
GLuint lastName = 0;

void name(GLsizei count, GLuint* names) {
    for (GLsizei i = 0; i < count; ++i) names[i] = ++lastName;
}

// Arguments that a function does not name are the caller's to clean up.
GLuint APIENTRY nothing() {
    return 0;
}
GLuint APIENTRY createOne() {
    return ++lastName;
}
void APIENTRY createSome(GLsizei count, GLuint* names) {
    name(count, names);
}
void APIENTRY createOfTarget(GLenum, GLsizei count, GLuint* names) {
    name(count, names);
}
GLenum APIENTRY checkFramebuffer() {
    return GL_FRAMEBUFFER_COMPLETE;
}
void APIENTRY getIntegers(GLenum what, GLint* value) {
    switch (what) {
        case GL_MAJOR_VERSION:
            *value = 4;
            break;
        case GL_MINOR_VERSION:
            *value = 5;
            break;
        case GL_VIEWPORT:
        case GL_SCISSOR_BOX:
            std::memset(value, 0, 4 * sizeof(GLint));
            break;
        case GL_UNIFORM_BUFFER_OFFSET_ALIGNMENT:
        case GL_TEXTURE_BUFFER_OFFSET_ALIGNMENT:
            *value = 256;
            break;
        case GL_NUM_EXTENSIONS:
            *value = 0;
            break;
        default:
            *value = 1 << 14;
    }
}
/// Of shaders and programs: they are fine, and have nothing to say.
void APIENTRY getStatus(GLuint, GLenum what, GLint* value) {
    *value = what == GL_INFO_LOG_LENGTH ? 0 : GL_TRUE;
}
void APIENTRY bufferData(GLuint, GLsizeiptr size, const void* data, GLenum) {
    if (!data) return;
    ++uploaded.calls;
    uploaded.bytes += static_cast<std::uint64_t>(size);
}
void APIENTRY bufferSubData(GLuint, GLintptr, GLsizeiptr size, const void*) {
    ++uploaded.calls;
    uploaded.bytes += static_cast<std::uint64_t>(size);
}

template <typename F>
void* address(F* function) {
    return reinterpret_cast<void*>(function);
}

}  // namespace

void* SilentSurface::procAddress(const char* wanted) const {
    const std::array<std::pair<std::string_view, void*>, 16> some = {{
        {"glCheckNamedFramebufferStatus", address(checkFramebuffer)},
        {"glCreateBuffers", address(createSome)},
        {"glCreateFramebuffers", address(createSome)},
        {"glCreateProgram", address(createOne)},
        {"glCreateQueries", address(createOfTarget)},
        {"glCreateRenderbuffers", address(createSome)},
        {"glCreateSamplers", address(createSome)},
        {"glCreateShader", address(createOne)},
        {"glCreateTextures", address(createOfTarget)},
        {"glCreateVertexArrays", address(createSome)},
        {"glGetIntegerv", address(getIntegers)},
        {"glGetProgramiv", address(getStatus)},
        {"glGetShaderiv", address(getStatus)},
        {"glNamedBufferData", address(bufferData)},
        {"glNamedBufferSubData", address(bufferSubData)},
        {"glGetError", address(nothing)},
    }};
    for (const auto& [known, function] : some)
        if (known == wanted) return function;
    return address(nothing);
}

SilentUploads SilentSurface::uploads() {
    return uploaded;
}

}  // namespace tessera::bench
