#include <GL/osmesa.h>

#include <array>
#include <cstddef>

#include "client/draw/surface/SharedLibrary.h"
#include "client/draw/surface/SurfaceKinds.h"

namespace tessera {
namespace {

struct OsMesa {
    decltype(&OSMesaCreateContextAttribs) createContext;
    decltype(&OSMesaDestroyContext) destroyContext;
    decltype(&OSMesaMakeCurrent) makeCurrent;
    decltype(&OSMesaGetProcAddress) procAddress;
};

Expected<OsMesa> loadOsMesa() {
    const auto library = SharedLibrary::open("libOSMesa.so.8", "libosmesa6");
    if (!library) return tl::unexpected(library.error());
    const OsMesa found{library->find<decltype(&OSMesaCreateContextAttribs)>("OSMesaCreateContextAttribs"),
                       library->find<decltype(&OSMesaDestroyContext)>("OSMesaDestroyContext"),
                       library->find<decltype(&OSMesaMakeCurrent)>("OSMesaMakeCurrent"),
                       library->find<decltype(&OSMesaGetProcAddress)>("OSMesaGetProcAddress")};
    if (found.createContext && found.destroyContext && found.makeCurrent && found.procAddress) return found;
    return fail(ErrorCode::kUnsupported,
                "libOSMesa.so.8 is too old: it gives no OpenGL of a wished version (libosmesa6 of Mesa 22 does)");
}

/// OSMesa wants a buffer of its own. It is one pixel: pictures are drawn into framebuffer objects.
class OsMesaSurface final : public Surface {
public:
    OsMesaSurface(const OsMesa& library, OSMesaContext context) : library_(library), context_(context) {}
    ~OsMesaSurface() override { library_.destroyContext(context_); }

    Expected<void> makeCurrent() override {
        if (!library_.makeCurrent(context_, buffer_.data(), GL_UNSIGNED_BYTE, 1, 1))
            return fail(ErrorCode::kUnsupported, "OSMesa refused to make its context current");
        return {};
    }
    void* procAddress(const char* name) const override { return reinterpret_cast<void*>(library_.procAddress(name)); }
    std::string description() const override {
        using GetString = const GLubyte*(GLAPIENTRY*)(GLenum);
        const auto getString = reinterpret_cast<GetString>(procAddress("glGetString"));
        const GLubyte* renderer = getString ? getString(GL_RENDERER) : nullptr;
        return std::string("OSMesa, ") + (renderer ? reinterpret_cast<const char*>(renderer) : "not current");
    }

private:
    OsMesa library_;
    OSMesaContext context_;
    alignas(16) std::array<std::byte, 16> buffer_{};
};

}  // namespace

Expected<std::unique_ptr<Surface>> makeOsMesaSurface(const SurfaceOptions& options) {
    if (options.device)
        return fail(ErrorCode::kUsage, "a device is chosen for \"egl\"; \"osmesa\" draws on the processor");
    static const Expected<OsMesa> library = loadOsMesa();
    if (!library) return tl::unexpected(library.error());
    const std::array<int, 15> attributes{OSMESA_FORMAT,
                                         OSMESA_RGBA,
                                         OSMESA_DEPTH_BITS,
                                         0,
                                         OSMESA_STENCIL_BITS,
                                         0,
                                         OSMESA_PROFILE,
                                         OSMESA_CORE_PROFILE,
                                         OSMESA_CONTEXT_MAJOR_VERSION,
                                         4,
                                         OSMESA_CONTEXT_MINOR_VERSION,
                                         5,
                                         0,
                                         0,
                                         0};
    const OSMesaContext context = library->createContext(attributes.data(), nullptr);
    if (!context)
        return fail(ErrorCode::kUnsupported, "OSMesa gives no OpenGL 4.5 core context; libosmesa6 of Mesa 22 does");
    return std::make_unique<OsMesaSurface>(*library, context);
}

}  // namespace tessera
