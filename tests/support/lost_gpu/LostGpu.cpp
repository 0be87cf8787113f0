/// Stands in libEGL's place (LD_LIBRARY_PATH) and hands everything on to it, until the file that $TESSERA_GPU_LOST_WHEN
/// names is there: from then on OpenGL says that the context is lost, as a GPU's driver does after a reset.
/// TESSERA_GPU_LOST_SAYS=status: by glGetGraphicsResetStatus alone, without an error.
#define EGL_NO_X11
#include <EGL/egl.h>
#include <dlfcn.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>

namespace {

template <typename Function>
Function real(const char* name) {
    static void* const library = ::dlopen(TESSERA_EGL_LIBRARY, RTLD_NOW | RTLD_LOCAL);
    return library ? reinterpret_cast<Function>(::dlsym(library, name)) : nullptr;
}

bool lost() {
    const char* const file = std::getenv("TESSERA_GPU_LOST_WHEN");
    return file && ::access(file, F_OK) == 0;
}
bool saysByStatusAlone() {
    const char* const how = std::getenv("TESSERA_GPU_LOST_SAYS");
    return how && std::strcmp(how, "status") == 0;
}

using Ask = unsigned int (*)();
Ask realError = nullptr, realStatus = nullptr;
constexpr unsigned int kContextLost = 0x0507, kUnknownContextReset = 0x8255;

unsigned int errorOf() {
    return lost() && !saysByStatusAlone() ? kContextLost : realError();
}
unsigned int statusOf() {
    return lost() ? kUnknownContextReset : realStatus();
}

}  // namespace

extern "C" {

__eglMustCastToProperFunctionPointerType eglGetProcAddress(const char* name) {
    const auto there = real<PFNEGLGETPROCADDRESSPROC>("eglGetProcAddress")(name);
    if (std::strcmp(name, "glGetError") == 0) {
        realError = reinterpret_cast<Ask>(there);
        return reinterpret_cast<__eglMustCastToProperFunctionPointerType>(errorOf);
    }
    if (std::strcmp(name, "glGetGraphicsResetStatus") == 0) {
        realStatus = reinterpret_cast<Ask>(there);
        return reinterpret_cast<__eglMustCastToProperFunctionPointerType>(statusOf);
    }
    return there;
}
EGLBoolean eglInitialize(EGLDisplay display, EGLint* major, EGLint* minor) {
    return real<PFNEGLINITIALIZEPROC>("eglInitialize")(display, major, minor);
}
const char* eglQueryString(EGLDisplay display, EGLint name) {
    return real<PFNEGLQUERYSTRINGPROC>("eglQueryString")(display, name);
}
EGLBoolean eglBindAPI(EGLenum api) {
    return real<PFNEGLBINDAPIPROC>("eglBindAPI")(api);
}
EGLContext eglCreateContext(EGLDisplay display, EGLConfig config, EGLContext share, const EGLint* attributes) {
    return real<PFNEGLCREATECONTEXTPROC>("eglCreateContext")(display, config, share, attributes);
}
EGLBoolean eglDestroyContext(EGLDisplay display, EGLContext context) {
    return real<PFNEGLDESTROYCONTEXTPROC>("eglDestroyContext")(display, context);
}
EGLBoolean eglMakeCurrent(EGLDisplay display, EGLSurface draw, EGLSurface read, EGLContext context) {
    return real<PFNEGLMAKECURRENTPROC>("eglMakeCurrent")(display, draw, read, context);
}
EGLContext eglGetCurrentContext() {
    return real<PFNEGLGETCURRENTCONTEXTPROC>("eglGetCurrentContext")();
}
EGLint eglGetError() {
    return real<PFNEGLGETERRORPROC>("eglGetError")();
}

}  // extern "C"
