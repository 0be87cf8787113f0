/// A file of lines that is only ever appended to, and becomes neither too long nor too many.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "common/base/Channel.h"
#include "common/base/Error.h"
#include "common/base/Log.h"
#include "server/sim/audit/AuditLine.h"

namespace tessera {

struct AuditLimits {
    std::uint64_t fileBytes = std::uint64_t{16} << 20;  ///< of one file; then another one is begun
    unsigned files = 8;                                 ///< FILE, FILE.1 (the one before), …, FILE.7
    std::size_t waitingLines = 8'192;                   ///< that are not written yet
};

/// Writes on a thread of its own: nobody waits for a disk. What the disk does not take is counted, said in the server's
/// log, and said in the file once it takes lines again. A server that starts goes on behind what is there. What stands
/// at the path is written: a file that somebody moves away or removes is followed by a fresh one. Neither a link nor a
/// file of something else is ever written to.
class AuditLog {
public:
    /// kFailed: the file cannot be written. kRefused: it is somebody else's, a link, no file, or holds something else,
    /// or another server writes it; it stays as it was. Nobody but this user may read it afterwards.
    [[nodiscard]] static Expected<std::unique_ptr<AuditLog>> open(const std::string& path, Log& log,
                                                                  const AuditLimits& limits = {});
    /// Writes what waits.
    ~AuditLog();
    AuditLog(const AuditLog&) = delete;
    AuditLog& operator=(const AuditLog&) = delete;

    /// From any thread. Never waits.
    void write(std::vector<AuditLine> lines);

private:
    AuditLog(std::string path, int file, Log& log, const AuditLimits& limits);
    void work();
    void append(const std::string& text, std::uint64_t lines);
    [[nodiscard]] bool standsAtItsPath() const;
    [[nodiscard]] std::string reopen();
    [[nodiscard]] std::string rotate();
    void lose(std::uint64_t lines, const std::string& why);

    const std::string path_;
    const AuditLimits limits_;
    Log& log_;
    int file_;
    bool torn_ = false;                     ///< its last line is half
    std::uint64_t lost_ = 0;                ///< lines, since the file last took one
    std::atomic<std::uint64_t> noRoom_{0};  ///< lines that found no room here
    std::atomic<std::uint64_t> waitingLines_{0};
    Channel<std::vector<AuditLine>> waiting_;
    std::thread thread_;
};

}  // namespace tessera
