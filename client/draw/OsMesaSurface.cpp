#include <GL/osmesa.h>

#include <malloc.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstdlib>
#include <mutex>

#include "client/draw/Surface.h"

namespace tessera {
namespace {

/// OSMesa wants a buffer of its own. It is one pixel: pictures are drawn into framebuffer objects.
class OsMesaSurface final : public Surface {
public:
    explicit OsMesaSurface(OSMesaContext context) : context_(context) {}
    ~OsMesaSurface() override { OSMesaDestroyContext(context_); }

    Expected<void> makeCurrent() override {
        if (!OSMesaMakeCurrent(context_, buffer_.data(), GL_UNSIGNED_BYTE, 1, 1))
            return fail(ErrorCode::kUnsupported, "OSMesa refused to make its context current");
        return {};
    }
    void* procAddress(const char* name) const override { return reinterpret_cast<void*>(OSMesaGetProcAddress(name)); }
    std::string description() const override {
        using GetString = const GLubyte*(GLAPIENTRY*)(GLenum);
        const auto getString = reinterpret_cast<GetString>(OSMesaGetProcAddress("glGetString"));
        const GLubyte* renderer = getString ? getString(GL_RENDERER) : nullptr;
        return std::string("OSMesa, ") + (renderer ? reinterpret_cast<const char*>(renderer) : "not current");
    }

private:
    OSMesaContext context_;
    alignas(16) std::array<std::byte, 16> buffer_{};
};

/// Framebuffers take tens of megabytes, and OSMesa clears them as it makes them: page by page of 4 KB that is a third of a first
/// picture's time. So what is allocated from here on, up to 32 MB a piece, lies in a heap whose next 64 MB may be large pages.
/// They are taken as they are used.
void allocateInLargePages() {
    constexpr int kStep = 64 << 20, kLargest = 32 << 20;
    if (!mallopt(M_MMAP_THRESHOLD, kLargest) || !mallopt(M_TOP_PAD, kStep) || !mallopt(M_TRIM_THRESHOLD, 2 * kStep)) return;
    // A block that the heap has no room for makes it grow.
    void* block = std::malloc(kLargest - 4096);
    const auto top = reinterpret_cast<std::uintptr_t>(sbrk(0));
    const std::uintptr_t page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
    const auto from = (reinterpret_cast<std::uintptr_t>(block) + page - 1) / page * page;
    if (block && top > from) madvise(reinterpret_cast<void*>(from), top - from, MADV_HUGEPAGE);
    std::free(block);
}

}  // namespace

Expected<std::unique_ptr<Surface>> makeSurface(std::string_view name) {
    if (name != "osmesa")
        return fail(ErrorCode::kUnsupported,
                    "no surface is called \"" + std::string(name) + "\"; this build has \"osmesa\"");
    static std::once_flag once;
    std::call_once(once, allocateInLargePages);
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
    const OSMesaContext context = OSMesaCreateContextAttribs(attributes.data(), nullptr);
    if (!context)
        return fail(ErrorCode::kUnsupported, "OSMesa gives no OpenGL 4.5 core context; libosmesa6 of Mesa 22 does");
    return std::make_unique<OsMesaSurface>(context);
}

void limitDrawThreads(int threads) {
    ::setenv("LP_NUM_THREADS", std::to_string(threads < 0 ? 0 : threads).c_str(), 1);
}

}  // namespace tessera
