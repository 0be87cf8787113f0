// No window system is asked for: headers without X11's.
#define EGL_NO_X11
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <fmt/format.h>

#include <array>
#include <cstring>
#include <vector>

#include "client/draw/surface/SharedLibrary.h"
#include "client/draw/surface/SurfaceKinds.h"

namespace tessera {
namespace {

struct Egl {
    PFNEGLGETPROCADDRESSPROC procAddress;
    PFNEGLINITIALIZEPROC initialize;
    PFNEGLQUERYSTRINGPROC queryString;
    PFNEGLBINDAPIPROC bindApi;
    PFNEGLCREATECONTEXTPROC createContext;
    PFNEGLDESTROYCONTEXTPROC destroyContext;
    PFNEGLMAKECURRENTPROC makeCurrent;
    PFNEGLGETCURRENTCONTEXTPROC currentContext;
    PFNEGLGETERRORPROC error;
    PFNEGLQUERYDEVICESEXTPROC queryDevices;
    PFNEGLQUERYDEVICESTRINGEXTPROC queryDeviceString;
    PFNEGLGETPLATFORMDISPLAYEXTPROC platformDisplay;
};

bool lists(const char* extensions, std::string_view name) {
    std::string_view all = extensions ? extensions : "";
    while (!all.empty()) {
        const std::size_t end = all.find(' ');
        if (all.substr(0, end) == name) return true;
        all = end == std::string_view::npos ? "" : all.substr(end + 1);
    }
    return false;
}

Expected<Egl> loadEgl() {
    const auto library = SharedLibrary::open("libEGL.so.1", "libegl1");
    if (!library) return tl::unexpected(library.error());
    Egl egl{};
    egl.procAddress = library->find<PFNEGLGETPROCADDRESSPROC>("eglGetProcAddress");
    egl.initialize = library->find<PFNEGLINITIALIZEPROC>("eglInitialize");
    egl.queryString = library->find<PFNEGLQUERYSTRINGPROC>("eglQueryString");
    egl.bindApi = library->find<PFNEGLBINDAPIPROC>("eglBindAPI");
    egl.createContext = library->find<PFNEGLCREATECONTEXTPROC>("eglCreateContext");
    egl.destroyContext = library->find<PFNEGLDESTROYCONTEXTPROC>("eglDestroyContext");
    egl.makeCurrent = library->find<PFNEGLMAKECURRENTPROC>("eglMakeCurrent");
    egl.currentContext = library->find<PFNEGLGETCURRENTCONTEXTPROC>("eglGetCurrentContext");
    egl.error = library->find<PFNEGLGETERRORPROC>("eglGetError");
    if (!egl.procAddress || !egl.initialize || !egl.queryString || !egl.bindApi || !egl.createContext ||
        !egl.destroyContext || !egl.makeCurrent || !egl.currentContext || !egl.error)
        return fail(ErrorCode::kUnsupported, "libEGL.so.1 lacks functions of EGL 1.4");
    const char* const extensions = egl.queryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    for (const char* needed :
         {"EGL_EXT_platform_base", "EGL_EXT_platform_device", "EGL_EXT_device_enumeration", "EGL_EXT_device_query"}) {
        // The last two were one at first.
        const bool there =
            lists(extensions, needed) || (std::strstr(needed, "_device_") && lists(extensions, "EGL_EXT_device_base"));
        if (!there)
            return fail(ErrorCode::kUnsupported,
                        fmt::format("this EGL has no devices to draw on: it lacks {}", needed));
    }
    egl.queryDevices = reinterpret_cast<PFNEGLQUERYDEVICESEXTPROC>(egl.procAddress("eglQueryDevicesEXT"));
    egl.queryDeviceString =
        reinterpret_cast<PFNEGLQUERYDEVICESTRINGEXTPROC>(egl.procAddress("eglQueryDeviceStringEXT"));
    egl.platformDisplay =
        reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(egl.procAddress("eglGetPlatformDisplayEXT"));
    if (!egl.queryDevices || !egl.queryDeviceString || !egl.platformDisplay)
        return fail(ErrorCode::kUnsupported, "libEGL.so.1 names extensions that it does not have");
    return egl;
}

struct Device {
    EGLDeviceEXT handle;
    bool software;
    std::string name;  ///< for messages
};

std::vector<Device> devicesOf(const Egl& egl) {
    std::array<EGLDeviceEXT, 64> handles{};
    EGLint count = 0;
    if (!egl.queryDevices(static_cast<EGLint>(handles.size()), handles.data(), &count)) return {};
    std::vector<Device> devices;
    for (EGLint i = 0; i < count; ++i) {
        EGLDeviceEXT const handle = handles[static_cast<std::size_t>(i)];
        const char* const extensions = egl.queryDeviceString(handle, EGL_EXTENSIONS);
        Device device{handle, lists(extensions, "EGL_MESA_device_software"), ""};
        const char* file = nullptr;
        if (lists(extensions, "EGL_EXT_device_drm")) file = egl.queryDeviceString(handle, EGL_DRM_DEVICE_FILE_EXT);
        device.name = device.software ? "Mesa's software" : file ? file : "a GPU";
        devices.push_back(std::move(device));
    }
    // Asked in vain for a name is no error of what follows.
    static_cast<void>(egl.error());
    return devices;
}

std::string listOf(const std::vector<Device>& devices) {
    std::string list;
    for (std::size_t i = 0; i < devices.size(); ++i)
        list += fmt::format("{}{}: {}", i == 0 ? "" : ", ", i, devices[i].name);
    return devices.empty() ? "there are none" : list;
}

Expected<std::size_t> choose(const std::vector<Device>& devices, std::optional<int> wanted) {
    if (wanted && (*wanted < 0 || static_cast<std::size_t>(*wanted) >= devices.size()))
        return fail(ErrorCode::kUnsupported,
                    fmt::format("EGL has no device {}; devices: {}", *wanted, listOf(devices)));
    if (devices.empty())
        return fail(ErrorCode::kUnsupported,
                    "EGL has no device to draw on (Debian's libegl-mesa0 brings a software one)");
    if (wanted) return static_cast<std::size_t>(*wanted);
    for (std::size_t i = 0; i < devices.size(); ++i)
        if (!devices[i].software) return i;
    return std::size_t{0};
}

class EglSurface final : public Surface {
public:
    EglSurface(const Egl& egl, EGLDisplay display, EGLContext context, std::string device)
        : egl_(egl), display_(display), context_(context), device_(std::move(device)) {}
    // The display stays: other surfaces of this process may lie on it.
    ~EglSurface() override {
        if (egl_.currentContext() == context_)
            egl_.makeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
        egl_.destroyContext(display_, context_);
    }

    Expected<void> makeCurrent() override {
        // What is current is of the thread and of the API that is bound there.
        if (egl_.bindApi(EGL_OPENGL_API) && egl_.makeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_))
            return {};
        return fail(ErrorCode::kUnsupported,
                    fmt::format("EGL on {} refused to make its context current (error 0x{:04x}): the GPU may be gone",
                                device_, egl_.error()));
    }
    void* procAddress(const char* name) const override { return reinterpret_cast<void*>(egl_.procAddress(name)); }
    std::string description() const override {
        using GetString = const unsigned char* (*)(unsigned int);
        const auto getString = reinterpret_cast<GetString>(procAddress("glGetString"));
        constexpr unsigned int kRendererName = 0x1F01;  // GL_RENDERER
        const unsigned char* const renderer =
            getString && egl_.currentContext() == context_ ? getString(kRendererName) : nullptr;
        return fmt::format("EGL on {}, {}", device_,
                           renderer ? reinterpret_cast<const char*>(renderer) : "not current");
    }

private:
    Egl egl_;
    EGLDisplay display_;
    EGLContext context_;
    std::string device_;
};

}  // namespace

Expected<std::unique_ptr<Surface>> makeEglSurface(const SurfaceOptions& options) {
    static const Expected<Egl> library = loadEgl();
    if (!library) return tl::unexpected(library.error());
    const Egl& egl = *library;
    const std::vector<Device> devices = devicesOf(egl);
    const auto chosen = choose(devices, options.device);
    if (!chosen) return tl::unexpected(chosen.error());
    const Device& device = devices[*chosen];
    const std::string name = fmt::format("device {} ({})", *chosen, device.name);
    const auto refuse = [&](std::string_view what) {
        return fail(ErrorCode::kUnsupported, fmt::format("EGL on {} {} (error 0x{:04x}); devices: {}", name, what,
                                                         egl.error(), listOf(devices)));
    };
    EGLDisplay const display = egl.platformDisplay(EGL_PLATFORM_DEVICE_EXT, device.handle, nullptr);
    if (display == EGL_NO_DISPLAY) return refuse("gives no display");
    EGLint major = 0, minor = 0;
    if (!egl.initialize(display, &major, &minor))
        return refuse("does not start: its driver is missing, or may not be used by this user");
    const char* const extensions = egl.queryString(display, EGL_EXTENSIONS);
    for (const char* needed : {"EGL_KHR_surfaceless_context", "EGL_KHR_no_config_context", "EGL_KHR_create_context"}) {
        if (!lists(extensions, needed)) return refuse(fmt::format("lacks {}", needed));
    }
    if (!egl.bindApi(EGL_OPENGL_API)) return refuse("has no OpenGL, only OpenGL ES");
    std::vector<EGLint> attributes{EGL_CONTEXT_MAJOR_VERSION_KHR,
                                   4,
                                   EGL_CONTEXT_MINOR_VERSION_KHR,
                                   5,
                                   EGL_CONTEXT_OPENGL_PROFILE_MASK_KHR,
                                   EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT_KHR,
                                   EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY_KHR,
                                   EGL_LOSE_CONTEXT_ON_RESET_KHR,
                                   EGL_NONE};
    // A GPU that is reset or taken out is an error of the next call then, where a driver knows how to tell.
    EGLContext context = egl.createContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes.data());
    if (context == EGL_NO_CONTEXT) {
        attributes.erase(attributes.end() - 3, attributes.end() - 1);
        context = egl.createContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes.data());
    }
    if (context == EGL_NO_CONTEXT) return refuse("gives no OpenGL 4.5 core context");
    return std::make_unique<EglSurface>(egl, display, context, name);
}

}  // namespace tessera
