#include "client/draw/surface/GlFunctions.h"

namespace tessera {
namespace {

constexpr GLint kNeededVersion = 45;

std::string_view nameOfError(GLenum error) {
    switch (error) {
        case GL_INVALID_ENUM:
            return "invalid enum";
        case GL_INVALID_VALUE:
            return "invalid value";
        case GL_INVALID_OPERATION:
            return "invalid operation";
        case GL_INVALID_FRAMEBUFFER_OPERATION:
            return "incomplete framebuffer";
        case GL_OUT_OF_MEMORY:
            return "out of memory";
        case GL_CONTEXT_LOST:
            return "the GPU was reset, or is gone";
        default:
            return "unknown error";
    }
}

}  // namespace

Expected<GlFunctions> GlFunctions::load(const Surface& surface) {
    GlFunctions gl;
#define TESSERA_GL_LOAD(name, upper) gl.name = reinterpret_cast<PFNGL##upper##PROC>(surface.procAddress("gl" #name));
    TESSERA_GL_FUNCTIONS(TESSERA_GL_LOAD)
    TESSERA_GL_STATE_FUNCTIONS(TESSERA_GL_LOAD)
#undef TESSERA_GL_LOAD
    // The address of a function says nothing about whether it works: the version does.
    if (!gl.GetIntegerv || !gl.GetError) return fail(ErrorCode::kUnsupported, "the surface has no OpenGL functions");
    GLint major = 0, minor = 0;
    gl.GetIntegerv(GL_MAJOR_VERSION, &major);
    gl.GetIntegerv(GL_MINOR_VERSION, &minor);
    if (10 * major + minor < kNeededVersion)
        return fail(ErrorCode::kUnsupported,
                    "OpenGL 4.5 is needed, the surface gives " + std::to_string(major) + "." + std::to_string(minor));
#define TESSERA_GL_TEST(name, upper) \
    if (!gl.name) return fail(ErrorCode::kUnsupported, "the surface lacks gl" #name);
    TESSERA_GL_FUNCTIONS(TESSERA_GL_TEST)
    TESSERA_GL_STATE_FUNCTIONS(TESSERA_GL_TEST)
#undef TESSERA_GL_TEST
    return gl;
}

bool GlFunctions::hasExtension(std::string_view name) const {
    GLint count = 0;
    GetIntegerv(GL_NUM_EXTENSIONS, &count);
    for (GLint i = 0; i < count; ++i)
        if (const auto* text = GetStringi(GL_EXTENSIONS, static_cast<GLuint>(i));
            text && name == reinterpret_cast<const char*>(text))
            return true;
    return false;
}

Expected<void> GlFunctions::check(std::string_view what) const {
    GLenum first = GetError();
    // Not every driver makes it an error of the calls that it drops.
    if (first == GL_NO_ERROR && GetGraphicsResetStatus() != GL_NO_ERROR) first = GL_CONTEXT_LOST;
    if (first == GL_NO_ERROR) return {};
    for (int i = 0; i < 16 && GetError() != GL_NO_ERROR; ++i) {
    }
    const ErrorCode code = first == GL_CONTEXT_LOST ? ErrorCode::kUnsupported : ErrorCode::kFailed;
    return fail(code, "OpenGL while " + std::string(what) + ": " + std::string(nameOfError(first)));
}

}  // namespace tessera
