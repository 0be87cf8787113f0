/// What assimp reads files through: whole ones, from the folder, to memory.
#pragma once

#include <algorithm>
#include <assimp/IOStream.hpp>
#include <assimp/IOSystem.hpp>
#include <cctype>
#include <cstring>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "server/import/reader/BeforeAssimp.h"
#include "server/import/reader/FolderFiles.h"

namespace tessera {

class MemoryStream : public Assimp::IOStream {
public:
    explicit MemoryStream(Bytes bytes) : bytes_(std::move(bytes)) {}

    std::size_t Read(void* target, std::size_t size, std::size_t count) override {
        if (size == 0) return 0;
        const std::size_t items = std::min(count, (bytes_.size() - at_) / size);
        if (items > 0) std::memcpy(target, bytes_.data() + at_, items * size);
        at_ += items * size;
        return items;
    }
    std::size_t Write(const void*, std::size_t, std::size_t) override { return 0; }
    aiReturn Seek(std::size_t offset, aiOrigin origin) override {
        // Backwards offsets arrive as huge numbers; the sum wraps to what is meant.
        const std::size_t base = origin == aiOrigin_SET ? 0 : origin == aiOrigin_CUR ? at_ : bytes_.size();
        const std::size_t target = base + offset;
        if (target > bytes_.size()) return aiReturn_FAILURE;
        at_ = target;
        return aiReturn_SUCCESS;
    }
    std::size_t Tell() const override { return at_; }
    std::size_t FileSize() const override { return bytes_.size(); }
    void Flush() override {}

private:
    Bytes bytes_;
    std::size_t at_ = 0;
};

/// Its only way to files.
class FolderIo : public Assimp::IOSystem {
public:
    explicit FolderIo(const FolderFiles& files, BeforeAssimp* before = nullptr) : files_(files), before_(before) {}

    bool Exists(const char* name) const override { return pathOf(name).has_value(); }
    char getOsSeparator() const override { return '/'; }
    Assimp::IOStream* Open(const char* name, const char* mode) override {
        if (std::strpbrk(mode, "wa+") != nullptr) return nullptr;
        const Expected<std::string> path = pathOf(name);
        Expected<Bytes> bytes = path ? files_.read(*path) : tl::unexpected(path.error());
        if (bytes && before_ != nullptr && !before_->lets(*path, *bytes)) return nullptr;
        return bytes ? new MemoryStream(std::move(*bytes)) : nullptr;
    }
    void Close(Assimp::IOStream* stream) override { delete stream; }

private:
    /// Libraries of materials as tools of other systems name them. Not others: of many names assimp only tries whether
    /// there is such a file.
    Expected<std::string> pathOf(const std::string& name) const {
        Expected<std::string> exact = files_.resolve(name);
        constexpr std::string_view kLibrary = ".mtl";
        const std::string_view ending =
            std::string_view(name).substr(name.size() - std::min(name.size(), kLibrary.size()));
        if (exact || !std::ranges::equal(ending, kLibrary, {}, [](unsigned char c) { return std::tolower(c); }))
            return exact;
        Expected<FolderFiles::Found> found = files_.find(name);
        return found ? Expected<std::string>(std::move(found->path)) : exact;
    }

    const FolderFiles& files_;
    BeforeAssimp* before_;
};

/// The folder of a file, but for the file itself and others, in whose place other texts are read.
class InPlaceOf : public FolderIo {
public:
    InPlaceOf(const FolderFiles& files, const std::string& path, std::string text) : FolderIo(files) {
        add(path, std::move(text));
    }
    void add(const std::string& path, std::string text) { texts_[path] = std::move(text); }

    bool Exists(const char* name) const override { return texts_.contains(name) || FolderIo::Exists(name); }
    Assimp::IOStream* Open(const char* name, const char* mode) override {
        const auto text = texts_.find(name);
        if (text == texts_.end()) return FolderIo::Open(name, mode);
        const ByteSpan bytes = asBytes(text->second);
        return new MemoryStream(Bytes(bytes.begin(), bytes.end()));
    }

private:
    std::map<std::string, std::string, std::less<>> texts_;
};

}  // namespace tessera
