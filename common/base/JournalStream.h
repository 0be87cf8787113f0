/// Messages for systemd's journal with their fields, where a program's output goes there anyway.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/FileHandle.h"

namespace tessera {

/// Whether a file is a stream to the journal, as JOURNAL_STREAM says (device and inode, systemd.exec(5)).
[[nodiscard]] bool leadsToJournal(int file);

/// Names of fields with what they hold: any bytes.
using JournalFields = std::vector<std::pair<std::string_view, std::string>>;
/// As the journal's native protocol has them (systemd, "Native Journal Protocol").
[[nodiscard]] std::string journalEntry(const JournalFields& fields);

/// The journal's socket. `send` waits for room.
class JournalSocket {
public:
    static constexpr const char* kUsual = "/run/systemd/journal/socket";
    /// Null: nobody listens there.
    [[nodiscard]] static std::unique_ptr<JournalSocket> connectTo(const std::string& path);
    /// False: it cannot be sent, as it is too large or nobody listens any more.
    [[nodiscard]] bool send(std::string_view entry) const;

private:
    explicit JournalSocket(FileHandle file) : file_(std::move(file)) {}
    FileHandle file_;
};

}  // namespace tessera
