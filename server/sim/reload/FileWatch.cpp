#include "server/sim/reload/FileWatch.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <utility>

#include "common/base/Error.h"

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

FileWatch::FileWatch(Tell tell) : tell_(std::move(tell)), stop_(::eventfd(0, EFD_CLOEXEC)) {
    TESSERA_CHECK(stop_ >= 0, "no eventfd can be made");
    thread_ = std::thread([this] { run(); });
}

FileWatch::~FileWatch() {
    ::eventfd_write(stop_, 1);
    thread_.join();
    ::close(stop_);
}

void FileWatch::watch(std::uint64_t group, WatchedFiles files, Duration quiet) {
    const Turn::Hold hold = turn_.take();
    orders_[group] = Group{.files = std::move(files), .quiet = quiet};
}

void FileWatch::forget(std::uint64_t group) {
    const Turn::Hold hold = turn_.take();
    orders_[group] = std::nullopt;
}

void FileWatch::run() {
    constexpr int kShare = 10;  // of its time: one in so many parts
    for (Duration took{};;) {
        const auto pause = std::chrono::duration_cast<std::chrono::milliseconds>(took * kShare).count();
        pollfd wait{stop_, POLLIN, 0};
        if (::poll(&wait, 1, std::max(1000 / kLooks, static_cast<int>(std::min<std::int64_t>(pause, 60'000)))) > 0)
            return;
        takeOrders();
        const TimePoint begin = clockNow();
        for (auto& [number, group] : groups_) lookAt(number, group, clockNow());
        took = clockNow() - begin;
    }
}

void FileWatch::takeOrders() {
    std::map<std::uint64_t, std::optional<Group>> orders;
    {
        const Turn::Hold hold = turn_.take();
        orders.swap(orders_);
    }
    for (auto& [number, order] : orders) {
        if (!order) {
            groups_.erase(number);
            continue;
        }
        Group& group = groups_[number];
        group = std::move(*order);
        group.seen = group.files.stamps;
        group.since = group.same = clockNow();
    }
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
