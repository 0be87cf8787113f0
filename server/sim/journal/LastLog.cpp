#include "server/sim/journal/LastLog.h"

#include <algorithm>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include "common/base/Hash.h"
#include "server/sim/recording/RecordBytes.h"

namespace tessera {
namespace {

constexpr std::size_t kBootBytes = 36;

std::string lineOf(const JournalEnd& end) {
    const std::string line =
        fmt::format("log {:<20} opening {:016x} written {:<20} synced {:<20} boot {:<36.36} sum ", end.log,
                    end.extent->opening, end.extent->written, end.extent->synced, end.extent->boot);
    return fmt::format("{}{:016x}\n", line, hash64(asBytes(std::string_view(line))));
}

/// Returns the number at the beginning of `text`, which is shortened by it.
std::optional<std::uint64_t> takeNumber(std::string_view& text, int base = 10) {
    std::uint64_t number = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number, base);
    if (error != std::errc()) return std::nullopt;
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    return number;
}

/// Goes on behind `name` and the spaces before it.
bool skipName(std::string_view& text, std::string_view name) {
    text.remove_prefix(std::min(text.size(), text.find_first_not_of(' ')));
    if (!text.starts_with(name)) return false;
    text.remove_prefix(name.size());
    return true;
}

std::optional<JournalEnd> endIn(std::string_view text) {
    JournalEnd end;
    std::string_view left = text;
    if (const auto bare = takeNumber(left)) {
        end.log = *bare;
        return left == "\n" ? std::optional(end) : std::nullopt;
    }
    const auto number = [&](std::string_view name, std::uint64_t& into, int base = 10) {
        const auto there = skipName(left, name) ? takeNumber(left, base) : std::nullopt;
        into = there.value_or(0);
        return there.has_value();
    };
    JournalEnd::Extent extent;
    if (!number("log ", end.log) || !number("opening ", extent.opening, 16) || !number("written ", extent.written) ||
        !number("synced ", extent.synced) || !skipName(left, "boot "))
        return std::nullopt;
    extent.boot = left.substr(0, kBootBytes);
    extent.boot.resize(extent.boot.find_last_not_of(' ') + 1);
    end.extent = std::move(extent);
    return lineOf(end) == text ? std::optional(std::move(end)) : std::nullopt;
}

}  // namespace

LastLog::~LastLog() {
    const OpenFiles files = files_.copy();
    if (files.now >= 0) disk_->calls().close(files.now);
    if (files.next >= 0) disk_->calls().close(files.next);
}

std::string LastLog::unfinished() const {
    return path_ + ".unfinished";
}

std::string LastLog::cure(std::uint64_t log) const {
    return fmt::format("write the number of its newest log into `last`: echo {} > {}", log, path_);
}

Expected<std::optional<JournalEnd>> LastLog::read() const {
    const auto bytesOf = [&]() -> Expected<std::optional<Bytes>> {
        const Expected<RecordSource> source = RecordSource::open(path_);
        std::error_code unknown;
        if (!source && !std::filesystem::exists(path_, unknown)) return std::optional<Bytes>();
        if (!source) return failWith(path_, source.error());
        constexpr std::uint64_t kMostBytes = 512;
        Expected<Bytes> bytes = source->read(0, std::min(source->size(), kMostBytes));
        if (!bytes) return failWith(path_, bytes.error());
        return std::optional(std::move(*bytes));
    };
    // Nobody writes over it meanwhile.
    const Expected<std::optional<Bytes>> bytes = files_.with([&](OpenFiles&) { return bytesOf(); });
    if (!bytes) return tl::unexpected(bytes.error());
    if (!*bytes) return std::optional<JournalEnd>();
    std::optional<JournalEnd> end = endIn(asText(**bytes));
    if (end) return end;
    return fail(ErrorCode::kBadInput,
                fmt::format("{}: it is damaged: it names no log. Put back a copy of it; or, to go on with the logs "
                            "that are there, write the number of the newest one into it: echo NUMBER > {}",
                            path_, path_));
}

Expected<void> LastLog::prepare(const LogName& log, std::uint64_t bytes) {
    const int error = files_.with([&](OpenFiles& files) { return make(files, log, bytes); });
    if (error == 0) return {};
    return fail(ErrorCode::kFailed, fmt::format("{}: it cannot be written: {}", unfinished(), std::strerror(error)));
}

std::string LastLog::line(const LogName& log, std::uint64_t written, std::uint64_t synced) const {
    return lineOf({.log = log.number,
                   .extent = JournalEnd::Extent{
                       .opening = log.opening, .written = written, .synced = synced, .boot = disk_->calls().boot()}});
}

int LastLog::make(OpenFiles& files, const LogName& log, std::uint64_t bytes) {
    drop(files);
    FileSystem& calls = disk_->calls();
    const std::string text = line(log, bytes, bytes);
    int made = -1;
    int error = calls.create(unfinished(), made);
    if (error == 0) error = calls.append(made, asBytes(std::string_view(text)), {});
    if (error == 0) error = disk_->sync(made);
    if (made >= 0) calls.close(made);
    // A file that is opened to be appended to cannot be written over.
    if (error == 0) error = calls.open(unfinished(), files.next);
    files.nextLog = log;
    if (error != 0) (void)calls.remove(unfinished());
    return error;
}

void LastLog::taken() {
    files_.with([&](OpenFiles& files) {
        if (files.now >= 0) disk_->calls().close(files.now);
        files.now = std::exchange(files.next, -1);
        files.log = files.nextLog;
    });
}

void LastLog::drop() {
    files_.with([&](OpenFiles& files) { drop(files); });
}

void LastLog::drop(OpenFiles& files) {
    if (files.next < 0) return;
    disk_->calls().close(std::exchange(files.next, -1));
    (void)disk_->calls().remove(unfinished());
}

int LastLog::say(std::uint64_t written, std::uint64_t synced) {
    return files_.with([&](const OpenFiles& files) {
        const std::string text = line(files.log, written, synced);
        return disk_->calls().overwrite(files.now, asBytes(std::string_view(text)));
    });
}

int LastLog::sync() {
    return files_.with([&](const OpenFiles& files) { return disk_->sync(files.now); });
}

bool LastLog::isThere() const {
    return files_.with([&](const OpenFiles& files) { return files.now < 0 || standsFor(path_, files.now, 0); });
}

}  // namespace tessera
