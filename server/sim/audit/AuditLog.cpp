#include "server/sim/audit/AuditLog.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string_view>
#include <utility>

namespace tessera {
namespace {

std::string nameOfOld(const std::string& path, unsigned number) {
    return number == 0 ? path : fmt::format("{}.{}", path, number);
}

/// Of an open file, or of what stands at a path; the serial number 0: nothing.
struct FileFacts {
    dev_t device = 0;
    ino_t serial = 0;
    std::uint64_t bytes = 0;
    nlink_t names = 0;
};
FileFacts factsOf(const struct stat& info) {
    return {info.st_dev, info.st_ino, static_cast<std::uint64_t>(info.st_size), info.st_nlink};
}
FileFacts factsOf(int file) {
    struct stat info {};
    return ::fstat(file, &info) == 0 ? factsOf(info) : FileFacts{};
}
FileFacts factsOf(const std::string& path) {
    struct stat info {};
    return ::stat(path.c_str(), &info) == 0 ? factsOf(info) : FileFacts{};
}

/// A server that was killed may have left half a line.
bool endsWithin(int file) {
    char last = '\n';
    if (const std::uint64_t bytes = factsOf(file).bytes; bytes > 0)
        (void)!::pread(file, &last, 1, static_cast<off_t>(bytes - 1));
    return last != '\n';
}

/// Whether it is empty, or begins as what this writes. Servers that were killed may have left parts of first lines.
bool isAuditLog(int file) {
    constexpr std::array<std::string_view, 2> kBeginnings{R"({"at":")", R"({"lost":)"};
    std::array<char, 64> begin{};
    const ssize_t count = ::pread(file, begin.data(), begin.size(), 0);
    if (count <= 0) return count == 0;
    std::string_view text(begin.data(), static_cast<std::size_t>(count));
    while (true) {
        const std::size_t end = text.find('\n');
        const std::string_view line = text.substr(0, end);
        const auto begins = [&](std::string_view known) { return line.starts_with(known); };
        const auto isPart = [&](std::string_view known) { return !line.empty() && known.starts_with(line); };
        if (std::ranges::any_of(kBeginnings, begins)) return true;
        if (std::ranges::none_of(kBeginnings, isPart)) return false;
        if (end == text.npos) return true;
        text.remove_prefix(end + 1);
    }
}

/// This user's alone, and of one server alone. It changes nothing about a file that it refuses.
std::string faultOf(int file) {
    struct stat found {};
    if (::fstat(file, &found) != 0 || !S_ISREG(found.st_mode)) return "it is no file";
    if (found.st_uid != ::geteuid()) return "it is somebody else's";
    if (::flock(file, LOCK_EX | LOCK_NB) != 0) return "another server writes it";
    if (!isAuditLog(file)) return "it holds something else, and is left as it is: name another file";
    if ((found.st_mode & 0777) != 0600 && ::fchmod(file, S_IRUSR | S_IWUSR) != 0) return "others may read it";
    return {};
}

/// No link is followed: it may lead to what is no log. kFailed: it cannot be written. kRefused: `faultOf` it.
Expected<int> openToAppend(const std::string& path) {
    constexpr int kHow = O_RDWR | O_APPEND | O_CREAT | O_CLOEXEC | O_NOCTTY | O_NONBLOCK | O_NOFOLLOW;
    const int file = ::open(path.c_str(), kHow, S_IRUSR | S_IWUSR);
    if (file < 0 && errno == ELOOP) return fail(ErrorCode::kRefused, "it is a link: name the file itself");
    if (file < 0) return fail(ErrorCode::kFailed, std::strerror(errno));
    if (const std::string fault = faultOf(file); !fault.empty()) {
        ::close(file);
        return fail(ErrorCode::kRefused, fault);
    }
    return file;
}

}  // namespace

Expected<std::unique_ptr<AuditLog>> AuditLog::open(const std::string& path, Log& log, const AuditLimits& limits) {
    const Expected<int> file = openToAppend(path);
    if (!file) return failWith("--audit " + path, file.error());
    return std::unique_ptr<AuditLog>(new AuditLog(path, *file, log, limits));
}

AuditLog::AuditLog(std::string path, int file, Log& log, const AuditLimits& limits)
    : path_(std::move(path)), limits_(limits), log_(log), file_(file), waiting_(limits.waitingLines) {
    torn_ = endsWithin(file_);
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
    constexpr int kNice = 10;                     // frames come first
    (void)::setpriority(PRIO_PROCESS, 0, kNice);  // Linux: of this thread
    constexpr std::size_t kAtOnce = std::size_t{64} << 10;
    while (const std::optional<std::vector<AuditLine>> lines = waiting_.pop()) {
        const std::string nowhere = reopen();
        if (const std::uint64_t none = noRoom_.exchange(0); none > 0) lose(none, "the disk is too slow");
        if (!nowhere.empty()) {
            lose(lines->size(), nowhere);
            waitingLines_ -= lines->size();
            continue;
        }
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

bool AuditLog::standsAtItsPath() const {
    const FileFacts ours = factsOf(file_), there = factsOf(path_);
    return ours.device == there.device && ours.serial == there.serial;
}

/// Somebody may have moved the file away, or removed it. Where no other one can be made a file that was moved goes on
/// taking the lines; nobody would read them in one that was removed. Why nothing takes them; empty: something does.
std::string AuditLog::reopen() {
    if (standsAtItsPath()) return {};
    const Expected<int> fresh = openToAppend(path_);
    if (!fresh) return factsOf(file_).names > 0 ? std::string() : fresh.error().message;
    ::close(std::exchange(file_, *fresh));
    torn_ = endsWithin(file_);
    return {};
}

/// Whole lines or none of them: what a full disk took half of is taken back.
void AuditLog::append(const std::string& lines, std::uint64_t count) {
    std::string text = lines;
    if (lost_ > 0) text = fmt::format("{{\"lost\":{}}}\n", lost_) + text;
    std::uint64_t before = factsOf(file_).bytes;
    if (before > 0 && before + text.size() > limits_.fileBytes) {
        if (const std::string fault = rotate(); !fault.empty())
            return lose(count, "no other file can be begun: " + fault);
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

/// The fresh file is there before the old ones go on by one. Why it cannot be done; empty: it is.
std::string AuditLog::rotate() {
    if (!standsAtItsPath()) return "something else stands in its place";
    const std::string made = path_ + ".new";
    const Expected<int> fresh = openToAppend(made);
    if (!fresh) return fmt::format("{}: {}", made, fresh.error().message);
    for (unsigned number = limits_.files - 1; number > 0; --number)
        (void)std::rename(nameOfOld(path_, number - 1).c_str(), nameOfOld(path_, number).c_str());
    if (std::rename(made.c_str(), path_.c_str()) != 0) {
        const int error = errno;
        ::close(*fresh);
        return std::strerror(error);
    }
    ::close(std::exchange(file_, *fresh));
    torn_ = false;
    return {};
}

void AuditLog::lose(std::uint64_t lines, const std::string& why) {
    if (lost_ == 0) log_.warning(fmt::format("{} does not take who did what: {}", path_, why));
    lost_ += lines;
}

}  // namespace tessera
