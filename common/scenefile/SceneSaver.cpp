// A scene into its file, and its arrays into the one beside it.

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>

#include "common/scenefile/ArraysFile.h"
#include "common/scenefile/SavedText.h"
#include "common/scenefile/SceneFile.h"
#include "common/scenefile/TextWriter.h"

namespace tessera {
namespace {

namespace fs = std::filesystem;

tl::unexpected<Error> failedSystemCall(const std::string& path, std::string_view what) {
    return fail(ErrorCode::kFailed, fmt::format("{}: {}: {}", path, what, std::strerror(errno)));
}

struct FilePlace {
    std::string path;            ///< where a link leads
    std::optional<mode_t> mode;  ///< of the file that is there already
};
Expected<FilePlace> placeOfFile(const std::string& path) {
    FilePlace place{.path = path, .mode = {}};
    struct stat there {};
    if (::stat(path.c_str(), &there) != 0) return place;
    if (!S_ISREG(there.st_mode))
        return fail(ErrorCode::kFailed, path + ": cannot write there: this is a folder, device, pipe or socket");
    place.mode = there.st_mode & 07777;
    std::error_code unknown;
    if (const fs::path real = fs::canonical(path, unknown); !unknown) place.path = real.string();
    return place;
}

/// Takes the place of a file at once. `path` is named in messages.
Expected<void> replaceFile(const std::string& path, const FilePlace& place,
                           const std::vector<std::string_view>& parts) {
    // Not mkstemp: a new file gets the rights that the user's mask leaves.
    std::string temporary;
    int fd = -1;
    for (int i = 0; fd < 0 && i < 100; ++i) {
        temporary = fmt::format("{}.{}.{}", place.path, ::getpid(), i);
        fd = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (fd < 0 && errno != EEXIST) break;
    }
    if (fd < 0) return failedSystemCall(path, "cannot write there");
    if (place.mode) ::fchmod(fd, *place.mode);
    bool written = true;
    for (const std::string_view part : parts)
        for (std::string_view left = part; written && !left.empty();) {
            const ssize_t done = ::write(fd, left.data(), left.size());
            if (done > 0)
                left.remove_prefix(static_cast<std::size_t>(done));
            else if (done < 0 && errno != EINTR)
                written = false;
        }
    // Else, of two files that belong together, a machine without power might keep one.
    if (written && parts.size() > 1 && ::fdatasync(fd) != 0) written = false;
    const int why = errno;
    const bool closed = ::close(fd) == 0;
    if (written && closed && ::rename(temporary.c_str(), place.path.c_str()) == 0) return {};
    if (!written) errno = why;
    auto error = failedSystemCall(path, "cannot write");
    ::unlink(temporary.c_str());
    return error;
}

// ---- the file beside

/// The name of the arrays that a text says in its first lines; empty: none.
std::string arraysNamedBy(const std::string& path) {
    constexpr std::size_t kHead = 2048;
    std::string head(kHead, '\0');
    std::ifstream in(path, std::ios::binary);
    in.read(head.data(), static_cast<std::streamsize>(head.size()));
    head.resize(static_cast<std::size_t>(in.gcount()));
    constexpr std::string_view kBefore = "arrays { file: \"";
    const std::size_t at = head.find(kBefore);
    if (at == std::string::npos) return {};
    const std::size_t begin = at + kBefore.size();
    const std::string name = head.substr(begin, head.find('"', begin) - begin);
    return isArraysName(name) ? name : std::string();
}

/// Whether this text's own saving has named them so: whatever else a text says, its file stays.
bool isOwnArrays(const std::string& path, std::string_view name) {
    constexpr std::size_t kIdBytes = 16, kEnd = std::string_view(".arrays").size();
    if (name.size() < kIdBytes + kEnd) return false;
    const std::string_view id = name.substr(name.size() - kEnd - kIdBytes, kIdBytes);
    return id.find_first_not_of("0123456789abcdef") == std::string_view::npos && name == arraysNameFor(path, id);
}

/// Whether another text in the folder names these arrays: a copy of the one that is replaced.
bool isNamedByOthers(const fs::path& folder, const std::string& arrays) {
    constexpr std::size_t kMostTexts = 4096;
    std::size_t seen = 0;
    std::error_code unknown;
    for (fs::directory_iterator at(folder, unknown), end; !unknown && at != end; at.increment(unknown)) {
        if (at->path().extension() != ".tsct") continue;
        if (++seen > kMostTexts || arraysNamedBy(at->path().string()) == arrays) return true;
    }
    return static_cast<bool>(unknown);
}

/// Arrays first, under a name of their own, then the text that names them, then what the text before has left: whenever
/// it is cut short, a text lies there with its arrays.
Expected<void> saveText(const std::string& path, const FilePlace& place, const Aspect& scene, std::string* arrays) {
    const Expected<WrittenText> text = writeNested(scene);
    if (!text) return failWith(path, text.error());
    const fs::path folder = fs::path(place.path).parent_path();
    std::string before = arraysNamedBy(place.path);
    if (!isOwnArrays(place.path, before)) before.clear();
    std::string name;
    if (!text->arrays.empty()) {
        const ArraysHead head = arraysHead(text->arrays);
        if (head.total > kMaxSceneFileBytes) return failWith(path, sceneTooLarge().value());
        name = arraysNameFor(place.path, head.id);
        const Expected<FilePlace> beside = placeOfFile((folder / name).string());
        if (!beside) return tl::unexpected(beside.error());
        std::vector<std::string_view> parts = {head.bytes};
        for (const Blob& array : text->arrays) parts.push_back(asText(array.bytes()));
        FilePlace where = *beside;
        where.mode = place.mode;
        if (Expected<void> written = replaceFile((folder / name).string(), where, parts); !written) return written;
        const Expected<std::string> content = textBesideArrays(*text, name, head.id);
        if (!content) return failWith(path, content.error());
        if (Expected<void> written = replaceFile(path, place, {*content}); !written) return written;
    } else {
        const Expected<std::string> content = textWithArrays(*text);
        if (!content) return failWith(path, content.error());
        if (Expected<void> written = replaceFile(path, place, {*content}); !written) return written;
    }
    if (!before.empty() && before != name && !isNamedByOthers(folder.empty() ? "." : folder, before))
        ::unlink((folder / before).c_str());
    if (arrays) *arrays = name.empty() ? name : (folder / name).string();
    return {};
}

}  // namespace

Expected<SceneEncoding> sceneEncodingOf(const std::string& path) {
    if (path.ends_with(".tsct")) return SceneEncoding::kText;
    if (path.ends_with(".tsc")) return SceneEncoding::kBinary;
    return fail(ErrorCode::kUsage, path + ": a scene is written as .tsct (text) or .tsc (binary)");
}

Expected<void> saveScene(const std::string& path, const Aspect& scene, const LaterParts& later, std::string* arrays) {
    const Expected<SceneEncoding> encoding = sceneEncodingOf(path);
    if (!encoding) return tl::unexpected(encoding.error());
    const Expected<FilePlace> place = placeOfFile(path);
    if (!place) return tl::unexpected(place.error());
    if (*encoding == SceneEncoding::kText && later.empty()) return saveText(path, *place, scene, arrays);
    const Expected<std::string> content = writeScene(scene, *encoding, later);
    if (!content) return failWith(path, content.error());
    return replaceFile(path, *place, {*content});
}

}  // namespace tessera
