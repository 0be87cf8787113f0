/// Wall files: protobuf text with errors that a person can act on.
#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/text_format.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "common/base/ShippedFiles.h"
#include "common/base/Utf8.h"
#include "common/codec/TextFaults.h"
#include "common/codec/WallCodec.h"
#include "common/codec/WallMessage.h"
#include "common/output/BlendExcess.h"
#include "proto/wall.pb.h"

namespace tessera {

namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::TextFormat;

/// Returns the text with '?' for each byte that is of no character.
std::string asUtf8(std::string text) {
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t length = utf8CharacterLength(std::string_view(text).substr(at));
        if (length == 0) text[at] = '?';
        at += std::max<std::size_t>(length, 1);
    }
    return text;
}

/// Says which text of a message is not UTF-8: the wire takes no other.
std::optional<std::string> otherThanUtf8(const google::protobuf::Message& message) {
    const google::protobuf::Reflection& in = *message.GetReflection();
    std::vector<const FieldDescriptor*> fields;
    in.ListFields(message, &fields);
    for (const FieldDescriptor* field : fields) {
        const int count = field->is_repeated() ? in.FieldSize(message, field) : 1;
        for (int i = 0; i < count; ++i) {
            if (field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
                std::optional<std::string> wrong = otherThanUtf8(
                    field->is_repeated() ? in.GetRepeatedMessage(message, field, i) : in.GetMessage(message, field));
                if (wrong) return wrong;
            } else if (field->type() == FieldDescriptor::TYPE_STRING) {
                const std::string text =
                    field->is_repeated() ? in.GetRepeatedString(message, field, i) : in.GetString(message, field);
                if (!isUtf8(text))
                    return fmt::format("{}: \"{}\" is not UTF-8: write it in UTF-8", field->name(), asUtf8(text));
            }
        }
    }
    return std::nullopt;
}

TextPlace placeOf(const WallFault& fault, const TextFormat::ParseInfoTree& tree) {
    const Descriptor* wall = proto::Wall::descriptor();
    const auto index = static_cast<int>(fault.index);
    const auto at = [](const TextFormat::ParseInfoTree& where, const FieldDescriptor* field, int i) {
        const TextFormat::ParseLocation location = where.GetLocation(field, i);
        return TextPlace{.line = location.line, .column = location.column};
    };
    switch (fault.part) {
        case WallFault::Part::kScreen:
            return at(tree, wall->FindFieldByNumber(proto::Wall::kScreensFieldNumber), index);
        case WallFault::Part::kUser:
            return at(tree, wall->FindFieldByNumber(proto::Wall::kUsersFieldNumber), index);
        case WallFault::Part::kHost:
            return at(tree, wall->FindFieldByNumber(proto::Wall::kHostsFieldNumber), index);
        case WallFault::Part::kTile: {
            const TextFormat::ParseInfoTree* host =
                tree.GetTreeForNested(wall->FindFieldByNumber(proto::Wall::kHostsFieldNumber), index);
            if (host == nullptr) return {};
            return at(*host, proto::Wall::Host::descriptor()->FindFieldByNumber(proto::Wall::Host::kTilesFieldNumber),
                      static_cast<int>(fault.tile));
        }
        case WallFault::Part::kSync:
            return at(tree, wall->FindFieldByNumber(proto::Wall::kSyncFieldNumber), -1);
        case WallFault::Part::kTracker:
            return at(tree, wall->FindFieldByNumber(proto::Wall::kTrackersFieldNumber), index);
        case WallFault::Part::kWand:
            return at(tree, wall->FindFieldByNumber(proto::Wall::kWandsFieldNumber), index);
        case WallFault::Part::kNavigation:
            return at(tree, wall->FindFieldByNumber(proto::Wall::kNavigationFieldNumber), -1);
        case WallFault::Part::kWall:
            return {.line = 0, .column = 0};
    }
    return {};
}

Expected<Wall> readWallText(std::string_view text, std::string_view fileName, const WallFiles& files) {
    if (text.size() > kMaxWallBytes) {
        return fail(ErrorCode::kLimit, fmt::format("{}: {} bytes, at most {} are allowed for a wall", fileName,
                                                   text.size(), kMaxWallBytes));
    }
    if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
    FirstTextFault errors(text, *proto::Wall::descriptor());
    TextFormat::ParseInfoTree tree;
    TextFormat::Parser parser;
    parser.RecordErrorsTo(&errors);
    parser.WriteLocationsTo(&tree);
    parser.SetRecursionLimit(8);
    proto::Wall message;
    const bool parsed = parser.ParseFromString(std::string(text), &message);
    if (errors.any()) return fail(ErrorCode::kBadInput, located(fileName, errors.place(), errors.message()));
    if (!parsed) return fail(ErrorCode::kBadInput, located(fileName, {}, "not a wall in protobuf text format"));
    if (const auto wrong = otherThanUtf8(message)) return fail(ErrorCode::kBadInput, located(fileName, {}, *wrong));

    tl::expected<Wall, WallFault> wall = wallOf(message, files);
    if (!wall) return fail(ErrorCode::kBadInput, located(fileName, placeOf(wall.error(), tree), wall.error().message));
    if (auto excess = findBlendExcess(*wall)) {
        const WallFault fault{
            .part = WallFault::Part::kTile, .index = excess->host, .tile = excess->tile, .message = {}};
        return fail(ErrorCode::kBadInput, located(fileName, placeOf(fault, tree), excess->message));
    }
    if (wall->name.empty()) wall->name = asUtf8(std::filesystem::path(fileName).stem().string());
    return std::move(*wall);
}

/// At most `most` bytes of a file and one more; more would be too many.
Expected<Bytes> bytesOfFile(const std::filesystem::path& path, std::size_t most) {
    std::error_code code;
    const std::filesystem::file_status status = std::filesystem::status(path, code);
    if (!std::filesystem::exists(status))
        return fail(ErrorCode::kNotFound, fmt::format("{}: there is no such file", path.string()));
    if (!std::filesystem::is_regular_file(status))
        return fail(ErrorCode::kBadInput, fmt::format("{}: not a file", path.string()));
    std::ifstream file(path, std::ios::binary);
    if (!file)
        return fail(ErrorCode::kBadInput, fmt::format("{}: cannot be opened: {}", path.string(), std::strerror(errno)));
    Bytes bytes(std::min<std::size_t>(most, std::filesystem::file_size(path, code)) + 1);
    file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    if (file.bad())
        return fail(ErrorCode::kBadInput, fmt::format("{}: cannot be read: {}", path.string(), std::strerror(errno)));
    bytes.resize(static_cast<std::size_t>(file.gcount()));
    if (bytes.size() > most)
        return fail(ErrorCode::kLimit, fmt::format("{}: larger than {} bytes", path.string(), most));
    return bytes;
}

/// Files that a wall file names lie beside it or below: a wall from somebody else reads nothing of this machine's. All
/// of them together fit into what a wall may be on the wire.
WallFiles filesBeside(const std::string& wallPath) {
    return [folder = std::filesystem::path(wallPath).parent_path(), left = kMaxWallWireBytes](
               const std::string& name, std::size_t atMost) mutable -> Expected<Bytes> {
        const std::filesystem::path relative = std::filesystem::path(name).lexically_normal();
        if (relative.is_absolute() || relative.empty() || *relative.begin() == "..")
            return fail(ErrorCode::kBadInput, fmt::format("\"{}\" is not beside the wall file or below", name));
        // Nor by a link that stands beside it.
        std::error_code code;
        const std::filesystem::path home = std::filesystem::weakly_canonical(folder.empty() ? "." : folder, code);
        const std::filesystem::path meant =
            std::filesystem::weakly_canonical(folder / relative, code).lexically_relative(home);
        if (code || meant.empty() || *meant.begin() == "..")
            return fail(ErrorCode::kBadInput,
                        fmt::format("\"{}\" is a link that leads out of the wall file's folder", name));
        auto bytes = bytesOfFile(folder / relative, std::min(atMost, left));
        if (bytes) left -= bytes->size();
        return bytes;
    };
}

}  // namespace

Expected<Wall> parseWall(std::string_view text, std::string_view fileName) {
    return readWallText(text, fileName, nullptr);
}

Expected<std::string> wallText(const Wall& wall) {
    proto::Wall message = messageOf(wall);
    if (const auto wrong = otherThanUtf8(message)) return fail(ErrorCode::kBadInput, *wrong);
    for (proto::Wall::Host& host : *message.mutable_hosts()) {
        for (proto::Wall::Tile& tile : *host.mutable_tiles()) {
            if (!tile.has_output()) continue;
            tile.mutable_output()->clear_warp_mesh();
            tile.mutable_output()->clear_blend_png();
        }
    }
    std::string text;
    TESSERA_CHECK(TextFormat::PrintToString(message, &text), "a message can be printed");
    return text;
}

Expected<Wall> loadWall(const std::string& path) {
    std::error_code code;
    const std::filesystem::file_status status = std::filesystem::status(path, code);
    if (!std::filesystem::exists(status))
        return fail(ErrorCode::kNotFound, fmt::format("{}: there is no such wall file{}", path, nearestFileHint(path)));
    if (!std::filesystem::is_regular_file(status))
        return fail(ErrorCode::kBadInput, fmt::format("{}: not a file with a wall in it", path));
    std::ifstream file(path, std::ios::binary);
    if (!file) return fail(ErrorCode::kBadInput, fmt::format("{}: cannot be opened: {}", path, std::strerror(errno)));
    std::string text(kMaxWallBytes + 1, '\0');
    file.read(text.data(), static_cast<std::streamsize>(text.size()));
    if (file.bad())
        return fail(ErrorCode::kBadInput, fmt::format("{}: cannot be read: {}", path, std::strerror(errno)));
    text.resize(static_cast<std::size_t>(file.gcount()));
    // Ours begin with the name of a field, or a comment.
    const std::size_t first = text.find_first_not_of(" \t\r\n\xEF\xBB\xBF");
    if (first != std::string::npos && (text[first] == '{' || text[first] == '<' || text.starts_with("PK") ||
                                       text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF")))
        return fail(ErrorCode::kBadInput,
                    fmt::format("{}: no wall file of ours; of SGCT, ParaView, nDisplay, MPCDI or OpenCOVER: "
                                "tessera-convert {} my.wall",
                                path, path));
    return readWallText(text, path, filesBeside(path));
}

Expected<std::string> resolveWallPath(const std::string& nameOrPath, std::span<const std::string> folders) {
    return resolveShipped("wall", nameOrPath, folders, ".wall");
}

Expected<std::string> findWall(const std::string& nameOrPath, const std::string& executablePath) {
    return resolveWallPath(nameOrPath, shippedFolders("walls", executablePath));
}

}  // namespace tessera
