#include "server/sim/audit/AuditLog.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
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

/// Of an open file, or of what stands at a path; the serial number 0: nothing.
struct FileFacts {
    dev_t device = 0;
    ino_t serial = 0;
    std::uint64_t bytes = 0;
};
FileFacts factsOf(int file) {
    struct stat info {};
    return ::fstat(file, &info) == 0 ? FileFacts{info.st_dev, info.st_ino, static_cast<std::uint64_t>(info.st_size)}
                                     : FileFacts{};
}
FileFacts factsOf(const std::string& path) {
    struct stat info {};
    return ::stat(path.c_str(), &info) == 0
               ? FileFacts{info.st_dev, info.st_ino, static_cast<std::uint64_t>(info.st_size)}
               : FileFacts{};
}

/// A server that was killed may have left half a line.
bool endsWithin(const std::string& path, std::uint64_t bytes) {
    char last = '\n';
    if (const int whole = bytes > 0 ? ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK) : -1; whole >= 0) {
        (void)!::pread(whole, &last, 1, static_cast<off_t>(bytes - 1));
        ::close(whole);
    }
    return last != '\n';
}

/// This user's alone, and of one server alone.
std::string faultOf(int file) {
    struct stat found {};
    if (::fstat(file, &found) != 0 || !S_ISREG(found.st_mode)) return "it is no file";
    if (found.st_uid != ::geteuid()) return "it is somebody else's";
    if (::flock(file, LOCK_EX | LOCK_NB) != 0) return "another server writes it";
    if ((found.st_mode & 0777) != 0600 && ::fchmod(file, S_IRUSR | S_IWUSR) != 0) return "others may read it";
    return {};
}

}  // namespace

Expected<std::unique_ptr<AuditLog>> AuditLog::open(const std::string& path, Log& log, const AuditLimits& limits) {
    const auto why = [&](ErrorCode code, const std::string& what) {
        return fail(code, fmt::format("--audit {}: {}", path, what));
    };
    const int file = openToAppend(path);
    if (file < 0) return why(ErrorCode::kFailed, std::strerror(errno));
    if (const std::string fault = faultOf(file); !fault.empty()) {
        ::close(file);
        return why(fault == "it is no file" ? ErrorCode::kFailed : ErrorCode::kRefused, fault);
    }
    return std::unique_ptr<AuditLog>(new AuditLog(path, file, log, limits));
}

AuditLog::AuditLog(std::string path, int file, Log& log, const AuditLimits& limits)
    : path_(std::move(path)), limits_(limits), log_(log), file_(file), waiting_(limits.waitingLines) {
    torn_ = endsWithin(path_, factsOf(file_).bytes);
    thread_ = std::thread([this] { work(); });
}

AuditLog::~AuditLog() {
    waiting_.close();
    thread_.join();
    ::close(file_);
}

void AuditLog::write(std::vector<AuditLine> lines) {
    const std::size_t count = lines.size();
    if (count == 0) return;
    // Taken off again by the thread, once they are written.
    if (waitingLines_ += count; waitingLines_ <= limits_.waitingLines && waiting_.tryPush(std::move(lines))) return;
    waitingLines_ -= count;
    noRoom_ += count;
}

void AuditLog::work() {
    constexpr int kNice = 10;  // frames come first
    (void)::setpriority(PRIO_PROCESS, 0, kNice);  // Linux: of this thread
    constexpr std::size_t kAtOnce = std::size_t{64} << 10;
    while (const std::optional<std::vector<AuditLine>> lines = waiting_.pop()) {
        reopen();
        if (const std::uint64_t none = noRoom_.exchange(0); none > 0) lose(none, "the disk is too slow");
        std::string text;
        std::uint64_t count = 0;
        for (const AuditLine& line : *lines) {
            text += toJson(line) + "\n";
            ++count;
            if (text.size() < kAtOnce && count < lines->size()) continue;
            append(text, std::exchange(count, 0));
            text.clear();
        }
        if (count > 0) append(text, count);
        (void)::fdatasync(file_);
        waitingLines_ -= lines->size();
    }
}

/// Somebody may have moved the file away, or removed it.
void AuditLog::reopen() {
    const FileFacts ours = factsOf(file_), there = factsOf(path_);
    if (ours.device == there.device && ours.serial == there.serial) return;
    const int fresh = openToAppend(path_);
    if (fresh < 0) return;  // what is open takes the lines
    if (!faultOf(fresh).empty()) {
        ::close(fresh);
        return;
    }
    ::close(std::exchange(file_, fresh));
    torn_ = endsWithin(path_, factsOf(file_).bytes);
}

/// Whole lines or none of them: what a full disk took half of is taken back.
void AuditLog::append(const std::string& lines, std::uint64_t count) {
    std::string text = lines;
    if (lost_ > 0) text = fmt::format("{{\"lost\":{}}}\n", lost_) + text;
    std::uint64_t before = factsOf(file_).bytes;
    if (before > 0 && before + text.size() > limits_.fileBytes) {
        if (const int error = rotate(); error != 0)
            return lose(count, fmt::format("no other file can be begun: {}", std::strerror(error)));
        before = 0;
    }
    if (torn_) text = "\n" + text;
    for (std::size_t done = 0; done < text.size();) {
        const ssize_t wrote = ::write(file_, text.data() + done, text.size() - done);
        if (wrote > 0) {
            done += static_cast<std::size_t>(wrote);
            continue;
        }
        if (wrote < 0 && errno == EINTR) continue;
        const int error = wrote < 0 ? errno : EIO;
        (void)!::ftruncate(file_, static_cast<off_t>(before));
        return lose(count, std::strerror(error));
    }
    torn_ = false;
    if (std::exchange(lost_, 0) > 0) log_.info(fmt::format("{} takes lines again", path_));
}

/// The fresh file is there before the old ones go on by one. An errno; 0: it is done.
int AuditLog::rotate() {
    const std::string made = path_ + ".new";
    const int fresh = openToAppend(made);
    if (fresh < 0) return errno;
    if (!faultOf(fresh).empty()) {
        ::close(fresh);
        return EEXIST;
    }
    for (unsigned number = limits_.files - 1; number > 0; --number)
        (void)std::rename(nameOfOld(path_, number - 1).c_str(), nameOfOld(path_, number).c_str());
    if (std::rename(made.c_str(), path_.c_str()) != 0) {
        const int error = errno;
        ::close(fresh);
        return error;
    }
    ::close(std::exchange(file_, fresh));
    torn_ = false;
    return 0;
}

void AuditLog::lose(std::uint64_t lines, const std::string& why) {
    if (lost_ == 0) log_.warning(fmt::format("{} does not take who did what: {}", path_, why));
    lost_ += lines;
}

}  // namespace tessera
