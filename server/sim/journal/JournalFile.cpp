#include "server/sim/journal/JournalFile.h"

#include <cstring>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "common/base/SystemRandom.h"

namespace tessera {

JournalFile::JournalFile(JournalFile&& other) noexcept
    : disk_(std::move(other.disk_)),
      file_(std::exchange(other.file_, -1)),
      bytes_(other.bytes_),
      number_(other.number_),
      headers_(other.headers_),
      torn_(other.torn_) {}
JournalFile& JournalFile::operator=(JournalFile&& other) noexcept {
    std::swap(disk_, other.disk_);
    std::swap(file_, other.file_);
    std::swap(bytes_, other.bytes_);
    std::swap(number_, other.number_);
    std::swap(headers_, other.headers_);
    std::swap(torn_, other.torn_);
    return *this;
}
JournalFile::~JournalFile() {
    if (file_ >= 0) disk_->calls().close(file_);
}

Expected<JournalFile> JournalFile::create(std::shared_ptr<JournalDisk> disk, const std::string& path,
                                          journal::Opening opening) {
    JournalFile made;
    made.disk_ = std::move(disk);
    FileSystem& calls = made.disk_->calls();
    int error = calls.create(path, made.file_);
    if (error == 0) error = calls.append(made.file_, asBytes(kJournalMark), {});
    made.bytes_ = kJournalMark.size();
    opening.unique = systemRandom();
    const std::uint32_t format = opening.format;
    const RecordContent first = encodeJournal(std::move(opening));
    if (error == 0) error = made.append(first);
    made.headers_ = JournalHeaders(format, hash64(first.bytes()));
    if (error == 0) return made;
    if (made.file_ >= 0) (void)calls.remove(path);
    return fail(ErrorCode::kFailed, fmt::format("{}: the journal cannot be written: {}", path, std::strerror(error)));
}

int JournalFile::append(const RecordContent& content) {
    if (torn_)
        if (const int error = disk_->calls().truncate(file_, bytes_)) return error;
    const ByteSpan bytes = content.bytes();
    const RecordHeader header = headers_.make(content.kind, bytes.size(), hash64(bytes), number_);
    if (const int error = disk_->calls().append(file_, std::as_bytes(std::span(&header, 1)), bytes)) {
        cutOff();
        return error;
    }
    ++number_;
    bytes_ += sizeof(header) + bytes.size();
    return 0;
}

Expected<void> JournalFile::append(const RecordHeader& about,
                                   const std::function<Expected<ByteSpan>(std::uint64_t)>& piece) {
    const auto failed = [](int error) { return fail(ErrorCode::kFailed, std::strerror(error)); };
    if (torn_)
        if (const int error = disk_->calls().truncate(file_, bytes_)) return failed(error);
    const RecordHeader header = headers_.make(about.kind, about.bytes, about.contentHash, number_);
    ByteSpan before = std::as_bytes(std::span(&header, 1));
    std::uint64_t at = 0;
    do {
        const Expected<ByteSpan> next = at < about.bytes ? piece(at) : ByteSpan();
        const int error = next ? disk_->calls().append(file_, before, *next) : 0;
        if (!next || error != 0) {
            cutOff();
            return next ? failed(error) : tl::unexpected(next.error());
        }
        before = {};
        at += next->size();
    } while (at < about.bytes);
    ++number_;
    bytes_ += sizeof(header) + about.bytes;
    return {};
}

bool JournalFile::isWhole(const std::string& path) const {
    return standsFor(path, file_, bytes_);
}

/// Removes what was begun.
void JournalFile::cutOff() {
    torn_ = disk_->calls().truncate(file_, bytes_) != 0;
}

int JournalArrays::append(JournalFile& file, const ChangeList& list) {
    for (const Blob& blob : blobsOf(list)) {
        if (written_.contains(blob.id())) continue;
        if (!blob.resident()) return -1;
        if (const int error = file.append(encodeJournal(journal::Array{blob}))) return error;
        written_.insert(blob.id());
    }
    return 0;
}

}  // namespace tessera
