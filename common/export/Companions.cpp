#include "common/export/Companions.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

namespace tessera {
namespace {

constexpr std::string_view kMark = "written by Tessera, beside it:";
constexpr std::size_t kHeadBytes = std::size_t{1} << 20;

/// Nothing else is ever beside: a list that another hand wrote leads nowhere.
bool isSuffix(const std::string& suffix) {
    if (suffix == "bin" || suffix == "mtl") return true;
    const std::size_t dot = suffix.find('.');
    return dot > 0 && dot != std::string::npos && suffix.substr(dot) == ".png" &&
           std::all_of(suffix.begin(), suffix.begin() + static_cast<std::ptrdiff_t>(dot),
                       [](char c) { return c >= '0' && c <= '9'; });
}

}  // namespace

std::string Companions::name(std::string_view suffix) const {
    std::string plain = std::filesystem::path(path_).filename().string();
    for (char& c : plain) {
        const bool good = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
                          c == '_' || c == '.' || static_cast<unsigned char>(c) >= 0x80;
        if (!good) c = '_';
    }
    return fmt::format("{}.{}", plain, suffix);
}

std::string Companions::pathOf(std::string_view suffix) const {
    return (std::filesystem::path(path_).parent_path() / name(suffix)).string();
}

std::string Companions::add(std::string_view suffix, std::vector<ByteSlice> parts, LeavingFiles& files) {
    suffixes_ += fmt::format(" {}", suffix);
    files.files.push_back({.path = pathOf(suffix), .parts = std::move(parts)});
    return name(suffix);
}

std::string Companions::addPicture(Bytes png, LeavingFiles& files) {
    return add(fmt::format("{}.png", pictures_++), {ByteSlice(std::move(png))}, files);
}

std::string Companions::mark() const {
    return fmt::format("{}{}", kMark, suffixes_.empty() ? " nothing" : suffixes_);
}

std::set<std::string> Companions::known() const {
    std::ifstream file(path_, std::ios::binary);
    std::string head(kHeadBytes, '\0');
    file.read(head.data(), static_cast<std::streamsize>(head.size()));
    head.resize(static_cast<std::size_t>(file.gcount()));
    const std::size_t at = head.find(kMark);
    if (at == std::string::npos) return {};
    const std::size_t first = at + kMark.size();
    std::istringstream list(head.substr(first, head.find_first_of("\n\"", first) - first));
    std::set<std::string> paths;
    for (std::string suffix; list >> suffix;)
        if (isSuffix(suffix)) paths.insert(pathOf(suffix));
    return paths;
}

}  // namespace tessera
