#include "client/draw/surface/GlMemory.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <limits>
#include <string>
#include <string_view>

namespace tessera {
namespace {

// Of extensions that glcorearb.h leaves out; both in KiB. The second is of four numbers: free in all comes first.
constexpr GLenum kFreeNvx = 0x9049, kTextureFreeAti = 0x87FC;

std::optional<std::size_t> freeOnCard(const GlFunctions& gl) {
    std::array<GLint, 4> kib{};
    if (gl.hasExtension("GL_NVX_gpu_memory_info"))
        gl.GetIntegerv(kFreeNvx, kib.data());
    else if (gl.hasExtension("GL_ATI_meminfo"))
        gl.GetIntegerv(kTextureFreeAti, kib.data());
    else
        return std::nullopt;
    return std::size_t{1024} * static_cast<std::size_t>(std::max(0, kib[0]));
}

/// Behind `name` in a file of names and numbers; behind none the first one.
std::optional<std::size_t> numberIn(const std::filesystem::path& file, std::string_view name = {}) {
    std::ifstream in(file);
    std::string word;
    while (word != name)
        if (!(in >> word)) return std::nullopt;
    std::size_t number = 0;
    if (!(in >> number)) return std::nullopt;
    return number;
}

/// In the files of control groups: the one that this process is in. Empty: the outermost, or none.
std::filesystem::path ownGroup(const std::filesystem::path& root) {
    std::ifstream in(root / "proc/self/cgroup");
    constexpr std::string_view kVersion2 = "0::/";
    for (std::string line; std::getline(in, line);)
        if (line.starts_with(kVersion2)) return line.substr(kVersion2.size());
    return {};
}

}  // namespace

std::optional<std::size_t> freeOnMachine(const std::filesystem::path& root) {
    std::optional<std::size_t> free = numberIn(root / "proc/meminfo", "MemAvailable:");
    if (free) *free *= 1024;
    for (std::filesystem::path group = ownGroup(root);; group = group.parent_path()) {
        const std::filesystem::path at = root / "sys/fs/cgroup" / group;
        const auto most = numberIn(at / "memory.max"), taken = numberIn(at / "memory.current");
        if (most && taken) {
            // Files that have been read go before anybody is ended.
            const std::size_t files = numberIn(at / "memory.stat", "inactive_file").value_or(0);
            const std::size_t held = *taken - std::min(*taken, files), left = *most - std::min(*most, held);
            free = std::min(free.value_or(left), left);
        }
        if (group.empty()) return free;
    }
}

GlMemory memoryOfProcessor(std::optional<std::size_t> free, std::size_t taken) {
    if (!free) return {.limit = kLeastGlMemory, .there = std::numeric_limits<std::size_t>::max()};
    const std::size_t there = taken + *free;
    return {.limit = std::clamp(there / 4, kLeastGlMemory, kMostOnProcessor), .there = there, .hard = true};
}

GlMemory memoryForGl(const GlFunctions& gl, const Surface& surface, std::size_t taken) {
    if (drawsOnProcessor(surface)) return memoryOfProcessor(freeOnMachine(), taken);
    if (const std::optional<std::size_t> free = freeOnCard(gl))
        return {.limit = std::max(kLeastGlMemory, (taken + *free) / 4 * 3), .there = taken + *free};
    GlMemory memory = memoryOfProcessor(freeOnMachine(), taken);
    memory.there = std::numeric_limits<std::size_t>::max();
    memory.hard = false;
    return memory;
}

}  // namespace tessera
