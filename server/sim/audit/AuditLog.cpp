#include "server/sim/audit/AuditLog.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <utility>

namespace tessera {
namespace {

int openToAppend(const std::string& path) {
    return ::open(path.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC | O_NOCTTY | O_NONBLOCK, S_IRUSR | S_IWUSR);
}

std::string nameOfOld(const std::string& path, unsigned number) {
    return number == 0 ? path : fmt::format("{}.{}", path, number);
}

}  // namespace

Expected<std::unique_ptr<AuditLog>> AuditLog::open(const std::string& path, Log& log, const AuditLimits& limits) {
    const auto why = [&](const std::string& what) {
        return fail(ErrorCode::kFailed, fmt::format("--audit {}: {}", path, what));
    };
    const int file = openToAppend(path);
    if (file < 0) return why(std::strerror(errno));
    struct stat found {};
    if (::fstat(file, &found) != 0 || !S_ISREG(found.st_mode)) {
        ::close(file);
        return why("it is no file");
    }
    return std::unique_ptr<AuditLog>(new AuditLog(path, file, log, limits));
}

AuditLog::AuditLog(std::string path, int file, Log& log, const AuditLimits& limits)
    : path_(std::move(path)), limits_(limits), log_(log), file_(file), waiting_(limits.waitingBatches) {
    // A server that was killed may have left half a line: the next one begins on one of its own.
    struct stat found {};
    if (::fstat(file_, &found) == 0) bytes_ = static_cast<std::uint64_t>(found.st_size);
    char last = '\n';
    if (const int whole = bytes_ > 0 ? ::open(path_.c_str(), O_RDONLY | O_CLOEXEC) : -1; whole >= 0) {
        (void)!::pread(whole, &last, 1, static_cast<off_t>(bytes_ - 1));
        ::close(whole);
    }
    if (last != '\n') append("\n", 0);
    thread_ = std::thread([this] { work(); });
}

AuditLog::~AuditLog() {
    waiting_.close();
    thread_.join();
    ::close(file_);
}

void AuditLog::write(std::vector<AuditLine> lines) {
    const std::size_t count = lines.size();
    if (count > 0 && !waiting_.tryPush(std::move(lines))) noRoom_ += count;
}

void AuditLog::work() {
    constexpr int kNice = 10;  // frames come first
    (void)::setpriority(PRIO_PROCESS, 0, kNice);  // Linux: of this thread
    while (const std::optional<std::vector<AuditLine>> lines = waiting_.pop()) {
        std::string text;
        for (const AuditLine& line : *lines) text += toJson(line) + "\n";
        if (const std::uint64_t none = noRoom_.exchange(0); none > 0) lose(none, 0);
        append(text, lines->size());
        (void)::fdatasync(file_);
    }
}

/// Whole lines or none of them: what a full disk took half of is taken back.
void AuditLog::append(const std::string& lines, std::uint64_t count) {
    std::string text = lines;
    if (lost_ > 0) text = fmt::format("{{\"lost\":{}}}\n", lost_) + text;
    if (bytes_ > 0 && bytes_ + text.size() > limits_.fileBytes) rotate();
    for (std::size_t done = 0; done < text.size();) {
        const ssize_t wrote = ::write(file_, text.data() + done, text.size() - done);
        if (wrote > 0) {
            done += static_cast<std::size_t>(wrote);
            continue;
        }
        if (wrote < 0 && errno == EINTR) continue;
        const int error = wrote < 0 ? errno : EIO;
        (void)!::ftruncate(file_, static_cast<off_t>(bytes_));
        return lose(count, error);
    }
    bytes_ += text.size();
    if (std::exchange(lost_, 0) > 0) log_.info(fmt::format("{} takes lines again", path_));
}

void AuditLog::rotate() {
    for (unsigned number = limits_.files - 1; number > 0; --number)
        (void)std::rename(nameOfOld(path_, number - 1).c_str(), nameOfOld(path_, number).c_str());
    const int fresh = openToAppend(path_);
    if (fresh < 0) return;  // the old one is written on, under whatever name it has
    ::close(std::exchange(file_, fresh));
    bytes_ = 0;
}

void AuditLog::lose(std::uint64_t lines, int error) {
    if (lost_ == 0)
        log_.warning(fmt::format("{} does not take who did what: {}", path_,
                                 error != 0 ? std::strerror(error) : "the disk is too slow"));
    lost_ += lines;
}

}  // namespace tessera
