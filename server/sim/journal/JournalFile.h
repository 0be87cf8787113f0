/// One file of a journal under way.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <unordered_set>

#include "server/sim/journal/JournalDisk.h"
#include "server/sim/journal/JournalFormat.h"
#include "server/sim/journal/JournalHeaders.h"

namespace tessera {

/// A log or a snapshot that is written. Errors are errno values; 0: none.
class JournalFile {
public:
    JournalFile() = default;
    JournalFile(JournalFile&& other) noexcept;
    JournalFile& operator=(JournalFile&& other) noexcept;
    ~JournalFile();

    /// Makes or empties it, and writes the mark and the opening, which gets a random number.
    [[nodiscard]] static Expected<JournalFile> create(std::shared_ptr<JournalDisk> disk, const std::string& path,
                                                      journal::Opening opening);
    /// A record that cannot be written whole leaves no trace.
    [[nodiscard]] int append(const RecordContent& content);
    /// The same of content that is in memory in pieces only: `piece` gives them in order, from a place in the content
    /// on, none of them empty. Its error, or that of the disk, in words.
    [[nodiscard]] Expected<void> append(const RecordHeader& about,
                                        const std::function<Expected<ByteSpan>(std::uint64_t at)>& piece);
    [[nodiscard]] int sync() const { return disk_->sync(file_); }
    /// Whether that name stands for it, with all that is written.
    [[nodiscard]] bool isWhole(const std::string& path) const;
    [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
    [[nodiscard]] std::uint64_t openingHash() const { return headers_.openingHash(); }

private:
    void cutOff();

    std::shared_ptr<JournalDisk> disk_;
    int file_ = -1;
    std::uint64_t bytes_ = 0, number_ = 0;
    JournalHeaders headers_;
    bool torn_ = false;  ///< behind bytes_ lies what could not be removed yet
};

/// Appends the array once, and remembers that it did.
class JournalArrays {
public:
    /// All that the list names and the file lacks. An errno; -1: one is not here.
    [[nodiscard]] int append(JournalFile& file, const ChangeList& list);
    void clear() { written_.clear(); }

private:
    std::unordered_set<BlobId> written_;
};

}  // namespace tessera
