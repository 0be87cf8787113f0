// A scene into its file, and its arrays into the one beside it.

#include <dirent.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <thread>

#include "common/base/FileHandle.h"
#include "common/base/NewFile.h"
#include "common/scenefile/ArraysFile.h"
#include "common/scenefile/SavedText.h"
#include "common/scenefile/SceneFile.h"
#include "common/scenefile/TextWriter.h"

namespace tessera {
namespace {

namespace fs = std::filesystem;

/// Takes the place of a file at once, on the disk or as soon as the system likes. `path` is named in messages.
Expected<void> replaceFile(const std::string& path, const FilePlace& place, const std::vector<std::string_view>& parts,
                           bool onDisk) {
    Expected<NewFile> file = NewFile::beside(place, path);
    if (!file) return tl::unexpected(file.error());
    for (const std::string_view part : parts)
        if (Expected<void> written = file->write(part); !written) return written;
    if (onDisk)
        if (Expected<void> synced = file->sync(); !synced) return synced;
    return file->takePlace();
}

// ---- the file beside

/// Whether this text's own saving has named them so: whatever else a text says, its file stays.
bool isOwnArrays(const std::string& path, std::string_view name) {
    constexpr std::size_t kIdBytes = 16, kEnd = std::string_view(".arrays").size();
    if (name.size() < kIdBytes + kEnd) return false;
    const std::string_view id = name.substr(name.size() - kEnd - kIdBytes, kIdBytes);
    return id.find_first_not_of("0123456789abcdef") == std::string_view::npos && name == arraysNameFor(path, id);
}

/// A text's folder, locked: what one save finds there, no other takes away before the first has ended.
class SaveFolder {
public:
    explicit SaveFolder(const fs::path& path)
        : path_(path.empty() ? "." : path), handle_(::open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
        // Anybody who may read a shared folder can hold its lock for ever.
        constexpr std::chrono::seconds kPatience{5};
        const auto end = std::chrono::steady_clock::now() + kPatience;
        while (handle_.get() >= 0) {
            isLocked_ = ::flock(handle_.get(), LOCK_EX | LOCK_NB) == 0;
            if (isLocked_ || (errno != EWOULDBLOCK && errno != EINTR)) break;
            if (std::chrono::steady_clock::now() >= end) break;
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
        }
    }

    /// Its names are on the disk; false: nobody knows.
    bool sync() { return handle_.get() >= 0 && ::fsync(handle_.get()) == 0; }
    /// Without the lock all stays.
    void remove(const std::string& name) {
        if (isLocked_) ::unlinkat(handle_.get(), name.c_str(), 0);
    }
    /// Whether a file in it names these arrays, as copies of a text do, whatever they are called. What cannot be read
    /// may name them.
    [[nodiscard]] bool isNamed(const std::string& arrays) const {
        constexpr std::size_t kMostFiles = 4096;
        const std::unique_ptr<DIR, int (*)(DIR*)> listed(::opendir(path_.c_str()), &::closedir);
        if (!listed) return true;
        for (std::size_t seen = 0;;) {
            errno = 0;
            const dirent* entry = ::readdir(listed.get());
            if (!entry) return errno != 0;
            if (std::string_view(entry->d_name).ends_with(".arrays")) continue;
            if (++seen > kMostFiles || mayName(entry->d_name, arrays)) return true;
        }
    }

private:
    [[nodiscard]] bool mayName(const char* file, const std::string& arrays) const {
        struct stat info {};
        if (::fstatat(handle_.get(), file, &info, AT_SYMLINK_NOFOLLOW) != 0) return errno != ENOENT;
        // Where a link leads is looked at there, or reads no arrays of this folder.
        if (!S_ISREG(info.st_mode)) return false;
        const std::optional<std::string> head = headOfText((path_ / file).string());
        return !head || head->find(arrays) != std::string::npos;
    }

    fs::path path_;
    FileHandle handle_;
    bool isLocked_ = false;
};

/// What goes into the files, made before any of them is touched.
struct SavedFiles {
    std::string content;
    std::string arrays;  ///< name of the file beside; empty: there is none
    ArraysHead head;
    std::vector<Blob> blobs;
};
Expected<SavedFiles> filesOf(const FilePlace& place, const Aspect& scene, SceneEncoding encoding,
                             const LaterParts& later) {
    SavedFiles files;
    Expected<std::string> content;
    if (encoding == SceneEncoding::kBinary || !later.empty()) {
        content = writeScene(scene, encoding, later);
    } else {
        Expected<WrittenText> text = writeNested(scene);
        if (!text) return tl::unexpected(text.error());
        if (text->arrays.empty()) {
            content = textWithArrays(*text);
        } else {
            files.head = arraysHead(text->arrays);
            if (files.head.total > kMaxSceneFileBytes) return sceneTooLarge();
            files.arrays = arraysNameFor(place.path, files.head.id);
            content = textBesideArrays(*text, files.arrays, files.head.id);
            files.blobs = std::move(text->arrays);
        }
    }
    if (!content) return tl::unexpected(content.error());
    files.content = std::move(*content);
    return files;
}

/// True: nothing was there before.
Expected<bool> writeArrays(const std::string& path, const FilePlace& text, const SavedFiles& files) {
    struct stat there {};
    const bool isNew = ::lstat(path.c_str(), &there) != 0;
    const Expected<FilePlace> place = placeBeside(text, path);
    if (!place) return tl::unexpected(place.error());
    std::vector<std::string_view> parts = {files.head.bytes};
    for (const Blob& array : files.blobs) parts.push_back(asText(array.bytes()));
    if (Expected<void> written = replaceFile(path, *place, parts, true); !written)
        return tl::unexpected(written.error());
    return isNew;
}

/// Arrays first, under a name of their own, then the text that names them, then what the text before has left: whenever
/// it is cut short, a text lies there with its arrays.
Expected<void> saveText(const std::string& path, const FilePlace& place, const SavedFiles& files, std::string* arrays) {
    const fs::path parent = fs::path(place.path).parent_path();
    SaveFolder folder(parent);
    const std::optional<std::string> head = headOfText(place.path);
    std::string before = head ? arraysNamedIn(*head) : std::string();
    if (!isOwnArrays(place.path, before)) before.clear();
    const std::string beside = files.arrays.empty() ? std::string() : (parent / files.arrays).string();
    bool isNew = false;
    if (!beside.empty()) {
        const Expected<bool> written = writeArrays(beside, place, files);
        if (!written) return tl::unexpected(written.error());
        isNew = *written;
        folder.sync();
    }
    // Else, of two files that belong together, a machine without power might keep one.
    const bool onDisk = !beside.empty() || !before.empty();
    if (Expected<void> written = replaceFile(path, place, {files.content}, onDisk); !written) {
        if (isNew) folder.remove(files.arrays);
        return written;
    }
    if (!before.empty() && before != files.arrays && folder.sync() && !folder.isNamed(before)) folder.remove(before);
    if (arrays) *arrays = beside;
    return {};
}

}  // namespace

Expected<SceneEncoding> sceneEncodingOf(const std::string& path) {
    if (path.ends_with(".tsct")) return SceneEncoding::kText;
    if (path.ends_with(".tsc")) return SceneEncoding::kBinary;
    return fail(ErrorCode::kUsage, path + ": a scene is written as .tsct (text) or .tsc (binary)");
}

Expected<void> saveScene(const std::string& path, const Aspect& scene, const LaterParts& later, std::string* arrays) {
    if (arrays) arrays->clear();
    const Expected<SceneEncoding> encoding = sceneEncodingOf(path);
    if (!encoding) return tl::unexpected(encoding.error());
    const Expected<FilePlace> place = placeOfFile(path);
    if (!place) return tl::unexpected(place.error());
    const Expected<SavedFiles> files = filesOf(*place, scene, *encoding, later);
    if (!files) return failWith(path, files.error());
    if (*encoding == SceneEncoding::kText) return saveText(path, *place, *files, arrays);
    return replaceFile(path, *place, {files->content}, false);
}

}  // namespace tessera
