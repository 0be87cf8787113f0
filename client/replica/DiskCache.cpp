#include "client/replica/DiskCache.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <vector>

#include "common/image/Picture.h"

namespace tessera {
namespace {

constexpr std::size_t kMaxWaiting = 4096;

struct CachedFile {
    std::filesystem::path path;
    std::filesystem::file_time_type written;
    std::uint64_t bytes = 0;
};

/// Newest first.
std::vector<CachedFile> filesIn(const std::string& folder) {
    std::vector<CachedFile> files;
    std::error_code error;
    for (std::filesystem::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
        std::error_code ignored;
        if (it->path().extension() != ".blob" || !it->is_regular_file(ignored)) continue;
        const auto written = it->last_write_time(ignored);
        const std::uintmax_t bytes = it->file_size(ignored);
        if (bytes != static_cast<std::uintmax_t>(-1)) files.push_back({it->path(), written, bytes});
    }
    std::sort(files.begin(), files.end(),
              [](const CachedFile& a, const CachedFile& b) { return a.written > b.written; });
    return files;
}

}  // namespace

DiskCache::DiskCache(const std::string& folder, const std::string& host, std::uint64_t maxBytes, Log& log)
    : folder_(folder + "/" + host), maxBytes_(maxBytes), log_(log), waiting_(kMaxWaiting), thread_([this] { run(); }) {}

DiskCache::~DiskCache() {
    waiting_.close();
    thread_.join();
}

void DiskCache::load(const std::function<void(Blob)>& found) {
    std::uint64_t total = 0;
    for (const CachedFile& file : filesIn(folder_)) {
        total += file.bytes;
        if (total > maxBytes_) return;
        auto bytes = readFile(file.path.string(), file.bytes);
        std::error_code ignored;
        if (!bytes) continue;
        Blob blob(std::move(*bytes));
        if (toHex(blob.id()) != file.path.stem().string()) {
            log_.warning(fmt::format("{}: damaged, deleted", file.path.string()));
            std::filesystem::remove(file.path, ignored);
            continue;
        }
        std::filesystem::last_write_time(file.path, std::filesystem::file_time_type::clock::now(), ignored);
        found(std::move(blob));
    }
}

void DiskCache::store(const Blob& blob) {
    (void)waiting_.tryPush(blob);
}

void DiskCache::run() {
    while (const auto blob = waiting_.pop()) write(*blob);
}

void DiskCache::write(const Blob& blob) {
    const std::string path = fmt::format("{}/{}.blob", folder_, toHex(blob.id()));
    std::error_code ignored;
    if (blob.sizeBytes() > maxBytes_ || std::filesystem::exists(path, ignored)) return;
    if (auto written = writeFile(path, blob.bytes()); !written) {
        if (!complained_) log_.warning(fmt::format("the cache: {}", written.error().message));
        complained_ = true;
        return;
    }
    writtenBytes_ += blob.sizeBytes();
    if (writtenBytes_ > maxBytes_ / 8) makeRoom();
}

void DiskCache::makeRoom() {
    writtenBytes_ = 0;
    std::uint64_t total = 0;
    for (const CachedFile& file : filesIn(folder_)) {
        total += file.bytes;
        std::error_code ignored;
        if (total > maxBytes_) std::filesystem::remove(file.path, ignored);
    }
}

}  // namespace tessera
