#include "server/tools/WallFormats.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <utility>

#include "common/base/LowerCase.h"
#include "common/base/ShippedFiles.h"
#include "server/tools/mpcdi/MpcdiWall.h"
#include "server/tools/walls/CoverWall.h"
#include "server/tools/walls/NdisplayWall.h"
#include "server/tools/walls/PvxWall.h"
#include "server/tools/walls/SgctWall.h"
#include "server/tools/walls/WallReading.h"

namespace tessera {
namespace {

bool holdsWord(std::string_view text, std::string_view word) {
    return text.find(word) != std::string_view::npos;
}
bool isJsonObject(std::string_view text) {
    const std::size_t first = text.find_first_not_of(" \t\r\n\xEF\xBB\xBF");
    return first != std::string_view::npos && text[first] == '{';
}

constexpr WallFormat kWallFormats[] = {
    {"SGCT", ".json", false,
     [](std::string_view text) { return isJsonObject(text) && holdsWord(text, "\"masteraddress\""); },
     [](const std::string& path, std::string_view text) { return wallOfSgct(text, path); }},
    {"ParaView", ".pvx", true, [](std::string_view text) { return holdsWord(text, "<pvx"); },
     [](const std::string& path, std::string_view text) { return wallOfPvx(text, path); }},
    {"nDisplay", ".ndisplay", true,
     [](std::string_view text) { return isJsonObject(text) && holdsWord(text, "\"nDisplay\""); },
     [](const std::string& path, std::string_view text) { return wallOfNdisplay(text, path); }},
    {"MPCDI", ".mpcdi", true, [](std::string_view text) { return text.starts_with("PK") || holdsWord(text, "<MPCDI"); },
     [](const std::string& path, std::string_view) { return wallOfMpcdiFile(path); }},
    {"OpenCOVER", ".xml", false, [](std::string_view text) { return holdsWord(text, "<COCONFIG"); },
     [](const std::string& path, std::string_view text) { return wallOfCover(text, path); }},
};

/// Formats that these programs have left behind, by what tells them, and the way out of them.
constexpr std::pair<std::string_view, std::string_view> kOlderFormats[] = {
    {"<Cluster", "SGCT's older XML becomes JSON with SGCT's own config-converter"},
    {"[cluster_node]", "nDisplay's older text becomes .ndisplay in Unreal's editor: open it there and export it"}};

std::string wallEndingOf(std::string_view path) {
    return lowerCase(std::filesystem::path(path).extension().string());
}

/// Unreal and editors of Windows write UTF-16, with a mark at the beginning that tells. Halves of pairs that stand
/// alone are U+FFFD. Other texts stay.
std::string utf8Of(std::string text) {
    const bool bigEnds = text.starts_with("\xFE\xFF");
    if (!bigEnds && !text.starts_with("\xFF\xFE")) return text;
    const auto unit = [&](std::size_t at) {
        const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
        return static_cast<std::uint32_t>(bigEnds ? byte(at) << 8 | byte(at + 1) : byte(at + 1) << 8 | byte(at));
    };
    std::string out;
    for (std::size_t at = 2; at + 1 < text.size(); at += 2) {
        std::uint32_t code = unit(at);
        if (code >= 0xD800 && code < 0xE000) {
            const std::uint32_t second = code < 0xDC00 && at + 3 < text.size() ? unit(at + 2) : 0;
            const bool pair = second >= 0xDC00 && second < 0xE000;
            code = pair ? 0x10000 + ((code - 0xD800) << 10) + (second - 0xDC00) : 0xFFFD;
            if (pair) at += 2;
        }
        const int more = code < 0x80 ? 0 : code < 0x800 ? 1 : code < 0x10000 ? 2 : 3;
        constexpr unsigned char kFirst[] = {0, 0xC0, 0xE0, 0xF0};
        out += static_cast<char>(kFirst[more] | code >> (6 * more));
        for (int i = more - 1; i >= 0; --i) out += static_cast<char>(0x80 | (code >> (6 * i) & 0x3F));
    }
    return out;
}

/// All of a text; of an archive, which readers open themselves, its beginning.
Expected<std::string> wallFileText(const std::string& path) {
    std::error_code unread;
    const std::filesystem::file_status there = std::filesystem::status(path, unread);
    if (!std::filesystem::exists(there))
        return fail(ErrorCode::kNotFound, path + ": there is no such file" + nearestFileHint(path));
    if (!std::filesystem::is_regular_file(there))
        return fail(ErrorCode::kBadInput, path + ": this is a folder, device, pipe or socket, not a file");
    std::ifstream file(path, std::ios::binary);
    std::string text(kMostWallFileBytes + 1, '\0');
    file.read(text.data(), static_cast<std::streamsize>(text.size()));
    if (file.bad() || (file.gcount() == 0 && !file.eof()))
        return fail(ErrorCode::kBadInput, path + ": it may not be read");
    text.resize(static_cast<std::size_t>(file.gcount()));
    if (text.size() > kMostWallFileBytes && !text.starts_with("PK"))
        return fail(ErrorCode::kLimit,
                    fmt::format("{}: a description of a wall has at most {} bytes", path, kMostWallFileBytes));
    return utf8Of(std::move(text));
}

}  // namespace

std::span<const WallFormat> wallFormats() {
    return kWallFormats;
}

std::string wallFormatList() {
    std::string list;
    for (const WallFormat& format : wallFormats())
        list += fmt::format("{}{} {}", list.empty() ? "" : ", ", format.program, format.ending);
    return list;
}

bool namesForeignWall(std::string_view path) {
    const std::string ending = wallEndingOf(path);
    return std::ranges::any_of(wallFormats(),
                               [&](const WallFormat& format) { return format.wallsAlone && format.ending == ending; });
}

Expected<ForeignWall> readForeignWall(const std::string& path) {
    const Expected<std::string> text = wallFileText(path);
    if (!text) return tl::unexpected(text.error());
    const std::string ending = wallEndingOf(path);
    const std::span<const WallFormat> formats = wallFormats();
    const auto known = std::ranges::find_if(formats, [&](const WallFormat& format) { return format.knows(*text); });
    const auto named = std::ranges::find_if(formats, [&](const WallFormat& format) { return format.ending == ending; });
    // A file that is damaged says little of itself: then its name counts, where no other files are called so.
    if (known == formats.end() && (named == formats.end() || !named->wallsAlone)) {
        for (const auto& [word, cure] : kOlderFormats)
            if (holdsWord(*text, word)) return fail(ErrorCode::kBadInput, fmt::format("{}: {}", path, cure));
        return fail(ErrorCode::kBadInput, fmt::format("{}: it is no wall of another program that is read; those are {}",
                                                      path, wallFormatList()));
    }
    return (known == formats.end() ? named : known)->read(path, *text);
}

}  // namespace tessera
