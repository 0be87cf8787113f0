#include "common/base/ShippedFiles.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <system_error>

#include "common/base/Nearest.h"

namespace tessera {
namespace fs = std::filesystem;

std::vector<std::string> shippedFolders(const std::string& kind, const std::string& executablePath) {
    const fs::path folder = fs::path(executablePath).parent_path();
    std::vector<std::string> folders;
    for (const char* relative : {"..", "../share/tessera", "../../deploy"})
        folders.push_back((folder / relative / kind).lexically_normal().string());
    return folders;
}

Expected<std::string> resolveShipped(std::string_view what, const std::string& nameOrPath,
                                     std::span<const std::string> folders, std::string_view extension) {
    std::error_code none;
    if (!nameOrPath.empty() && nameOrPath.find('/') == std::string::npos)
        for (const std::string& folder : folders) {
            const fs::path shipped = fs::path(folder) / fmt::format("{}{}", nameOrPath, extension);
            if (fs::is_regular_file(shipped, none)) return shipped.string();
        }
    // Whatever exists is opened: who reads it says what is wrong with a folder.
    if (!nameOrPath.empty() && fs::exists(nameOrPath, none)) return nameOrPath;

    std::vector<std::string> names;
    for (const std::string& folder : folders)
        for (fs::directory_iterator it(folder, none), end; it != end; it.increment(none))
            if (it->path().extension() == extension) names.push_back(it->path().stem().string());
    std::sort(names.begin(), names.end());
    names.erase(std::unique(names.begin(), names.end()), names.end());
    const std::string nearest = nearestName(nameOrPath, names);
    return fail(
        ErrorCode::kNotFound,
        fmt::format("there is no {} \"{}\", neither shipped nor as a file{}; shipped: {}", what, nameOrPath,
                    nearest.empty() ? nearestFileHint(nameOrPath) : fmt::format(" (did you mean \"{}\"?)", nearest),
                    names.empty() ? "none found beside the program" : fmt::format("{}", fmt::join(names, ", "))));
}

std::string nearestFileHint(const std::string& path) {
    constexpr std::size_t kMostNames = 10'000;
    std::error_code none;
    const fs::path wanted(path), folder = wanted.parent_path();
    std::vector<std::string> names;
    for (fs::directory_iterator it(folder.empty() ? "." : folder, none), end; it != end; it.increment(none)) {
        if (names.size() == kMostNames) break;
        if (fs::is_regular_file(it->path(), none)) names.push_back(it->path().filename().string());
    }
    std::sort(names.begin(), names.end());
    const std::string nearest = nearestName(wanted.filename().string(), names);
    return nearest.empty() ? "" : fmt::format(" (did you mean \"{}\"?)", (folder / nearest).string());
}

Expected<std::string> findScene(const std::string& nameOrPath, const std::string& executablePath) {
    if (nameOrPath.find_first_of("./") != std::string::npos) {
        std::error_code none;
        if (nameOrPath.find("://") != std::string::npos || fs::exists(nameOrPath, none) || none) return nameOrPath;
        const std::string hint = nearestFileHint(nameOrPath);
        if (hint.empty()) return nameOrPath;
        return fail(ErrorCode::kNotFound, fmt::format("{}: there is no such file{}", nameOrPath, hint));
    }
    return resolveShipped("scene", nameOrPath, shippedFolders("scenes", executablePath), ".tsct");
}

}  // namespace tessera
