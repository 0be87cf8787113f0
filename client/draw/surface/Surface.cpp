#include "client/draw/surface/Surface.h"

#include <malloc.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mutex>

#include "client/draw/surface/SurfaceKinds.h"

namespace tessera {
namespace {

struct SurfaceKind {
    const char* name;
    Expected<std::unique_ptr<Surface>> (*make)(const SurfaceOptions& options);
};
constexpr std::array<SurfaceKind, 2> kSurfaceKinds = {{{"osmesa", makeOsMesaSurface}, {"egl", makeEglSurface}}};

/// Whether the system has so many bytes of large pages at hand, as far as it tells (/proc/buddyinfo: of each zone, free
/// pieces of 1, 2, 4 … pages). Where it has none it moves the memory of others until it has, which takes longer than
/// small pages do.
bool hasLargePages(std::size_t bytes) {
    constexpr std::size_t kLargePage = 2 << 20;
    std::FILE* const file = std::fopen("/proc/buddyinfo", "re");
    if (!file) return false;
    std::size_t found = 0;
    std::array<char, 512> line;
    while (std::fgets(line.data(), line.size(), file)) {
        // "Node 0, zone   Normal     14      0 …"
        const char* at = std::strstr(line.data(), "zone");
        if (!at) continue;
        at += std::strcspn(at, " ");
        at += std::strspn(at, " ");
        at += std::strcspn(at, " ");
        std::size_t size = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
        for (char* end = nullptr;; at = end, size *= 2) {
            const unsigned long pieces = std::strtoul(at, &end, 10);
            if (end == at) break;
            if (size >= kLargePage) found += pieces * size;
        }
    }
    static_cast<void>(std::fclose(file));
    return found >= bytes;
}

/// Framebuffers take tens of megabytes, and Mesa clears them as it makes them: page by page of 4 KB that is a third of
/// a first picture's time. So what is allocated from here on, up to 32 MB a piece, lies in a heap whose next 64 MB may
/// be large pages. They are taken as they are used.
void allocateInLargePages() {
    constexpr int kStep = 64 << 20, kLargest = 32 << 20;
    if (!mallopt(M_MMAP_THRESHOLD, kLargest) || !mallopt(M_TOP_PAD, kStep) || !mallopt(M_TRIM_THRESHOLD, 2 * kStep))
        return;
    // Of what is at hand others take some meanwhile.
    if (!hasLargePages(2 * static_cast<std::size_t>(kStep))) return;
    // A block that the heap has no room for makes it grow.
    void* block = std::malloc(kLargest - 4096);
    const auto top = reinterpret_cast<std::uintptr_t>(sbrk(0));
    const std::uintptr_t page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
    const auto from = (reinterpret_cast<std::uintptr_t>(block) + page - 1) / page * page;
    if (block && top > from) madvise(reinterpret_cast<void*>(from), top - from, MADV_HUGEPAGE);
    std::free(block);
}

}  // namespace

bool drawsOnProcessor(const Surface& surface) {
    const std::string description = surface.description();
    for (const char* software : {"llvmpipe", "softpipe", "swrast"})
        if (description.find(software) != std::string::npos) return true;
    return false;
}

std::string surfaceNames() {
    std::string names;
    for (const SurfaceKind& kind : kSurfaceKinds) names += (names.empty() ? "" : ", ") + std::string(kind.name);
    return names;
}

Expected<std::unique_ptr<Surface>> makeSurface(std::string_view name, const SurfaceOptions& options) {
    for (const SurfaceKind& kind : kSurfaceKinds) {
        if (name != kind.name) continue;
        static std::once_flag once;
        std::call_once(once, allocateInLargePages);
        return kind.make(options);
    }
    return fail(ErrorCode::kUnsupported,
                "no surface is called \"" + std::string(name) + "\"; this build has: " + surfaceNames());
}

void limitDrawThreads(int threads) {
    ::setenv("LP_NUM_THREADS", std::to_string(threads < 0 ? 0 : threads).c_str(), 1);
}

}  // namespace tessera
