#include "server/sim/reload/FileWatch.h"

#include <sys/stat.h>

#include <algorithm>
#include <utility>

namespace tessera {
namespace {

std::int64_t nanoseconds(const timespec& time) {
    return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

FileStamp stampOf(const std::string& file) {
    struct stat info {};
    if (::stat(file.c_str(), &info) != 0) return {};
    return {.device = info.st_dev,
            .node = info.st_ino,
            .bytes = static_cast<std::uint64_t>(info.st_size),
            .written = nanoseconds(info.st_mtim),
            .changed = nanoseconds(info.st_ctim)};
}

}  // namespace

std::vector<FileStamp> stampsOf(const std::vector<std::string>& files) {
    std::vector<FileStamp> stamps;
    stamps.reserve(files.size());
    for (const std::string& file : files) stamps.push_back(stampOf(file));
    return stamps;
}

FileWatch::FileWatch(Tell tell, const MakeLane& lane, const TimeSource& time)
    : tell_(std::move(tell)), time_(time), lane_(lane({})) {
    lane_->post([this] { look(); });
}

void FileWatch::watch(std::uint64_t group, WatchedFiles files, Duration quiet) {
    lane_->post([this, group, files = std::move(files), quiet] {
        const TimePoint now = time_.now();
        groups_[group] = {.files = files, .quiet = quiet, .seen = files.stamps, .since = now, .same = now};
    });
}

void FileWatch::forget(std::uint64_t group) {
    lane_->post([this, group] { groups_.erase(group); });
}

void FileWatch::again(std::uint64_t group) {
    lane_->postAt(time_.now() + kAgain, [this, group] { tell_(group, News::kChanged); });
}

void FileWatch::look() {
    constexpr int kShare = 10;  // of its time: one in so many parts
    constexpr Duration kOften = Duration(std::chrono::seconds(1)) / kLooks, kLongest = std::chrono::minutes(1);
    const TimePoint begin = time_.now();
    for (auto& [number, group] : groups_) lookAt(number, group, time_.now());
    const TimePoint end = time_.now();
    lane_->postAt(end + std::clamp(kShare * (end - begin), kOften, kLongest), [this] { look(); });
}

void FileWatch::lookAt(std::uint64_t number, Group& group, TimePoint now) const {
    std::vector<FileStamp> stamps = stampsOf(group.files.paths);
    if (stamps != group.seen) {
        group.seen = std::move(stamps);
        group.since = now;
    }
    const Duration quiet = now - group.since;
    const bool gone = group.seen.front() == FileStamp();
    if (gone && quiet >= kGone && !std::exchange(group.goneTold, true)) tell_(number, News::kGone);
    if (group.seen == group.files.stamps || (gone && quiet >= kQuiet)) group.same = now;
    if (gone) return;
    group.goneTold = false;
    if (group.seen == group.files.stamps || (quiet < group.quiet && now - group.same < kLongest)) return;
    group.files.stamps = group.seen;
    group.quiet = kQuiet;
    group.same = now;
    tell_(number, News::kChanged);
}

}  // namespace tessera
