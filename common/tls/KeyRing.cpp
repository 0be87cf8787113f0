#include "common/tls/KeyRing.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

namespace tessera {

namespace {

/// What tells that a file is another one, or has been written to. By its name: folders are replaced, too.
std::string signatureOf(const std::string& path) {
    struct stat info {};
    if (::stat(path.c_str(), &info) != 0) return "none;";
    return fmt::format("{} {} {} {} {} {} {};", info.st_dev, info.st_ino, info.st_mode, info.st_uid, info.st_size,
                       info.st_mtim.tv_sec, info.st_mtim.tv_nsec);
}

}  // namespace

std::string KeyRing::signature() const {
    std::string all;
    std::vector<std::string> files;
    std::error_code error;
    for (std::filesystem::directory_iterator each(folder_, error), none; !error && each != none; each.increment(error))
        files.push_back(each->path().string());
    std::ranges::sort(files);
    for (const std::string& file : files) all += file + " " + signatureOf(file);
    return signatureOf(folder_) + all;
}

Expected<std::unique_ptr<KeyRing>> KeyRing::open(const std::string& folder, Read read) {
    std::unique_ptr<KeyRing> ring(new KeyRing);
    ring->folder_ = folder;
    ring->seen_ = ring->signature();  // before it is read: what changes in between is seen
    const Expected<TlsKeys> keys = read();
    Expected<std::shared_ptr<const TlsContext>> made = keys ? TlsContext::make(*keys) : tl::unexpected(keys.error());
    if (!made && made.error().message.starts_with(folder)) return tl::unexpected(made.error());
    if (!made) return failWith(folder, made.error());
    ring->current_ = std::move(*made);
    ring->keys_ = *keys;
    ring->read_ = std::move(read);
    return ring;
}

KeyRing::~KeyRing() {
    rest();
}

void KeyRing::rest() {
    if (thread_.joinable()) {
        ::eventfd_write(stop_, 1);
        thread_.join();
    }
    if (stop_ >= 0) ::close(std::exchange(stop_, -1));
}

void KeyRing::watch(std::function<void()> onChange, std::function<void(const std::string&)> onWords) {
    onChange_ = std::move(onChange);
    onWords_ = std::move(onWords);
    stop_ = ::eventfd(0, EFD_CLOEXEC);
    if (stop_ < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
    thread_ = std::thread([this] { run(); });
}

std::shared_ptr<const TlsContext> KeyRing::current() const {
    const Turn::Hold hold = turn_.take();
    return current_;
}

/// A look at the names of the folder, four times a second: what watches a folder for us (inotify) follows the one that
/// was there at first, hears nothing of rights, and says nothing while it is changed without a pause.
void KeyRing::run() {
    constexpr int kLookEvery = 250;  // ms
    constexpr int kLooksADay = 86'400'000 / kLookEvery, kLooksASecond = 1000 / kLookEvery;
    sayFaults();
    for (int looks = 1;; ++looks) {
        pollfd wait{stop_, POLLIN, 0};
        if (::poll(&wait, 1, kLookEvery) > 0) return;
        std::string now = signature();
        if (now != seen_) {
            seen_ = std::move(now);
            reload();
        } else if (looks % kLooksASecond == 0) {
            onChange_();  // the time is another: a key may have ended
        }
        if (looks % kLooksADay == 0) sayFaults();
    }
}

void KeyRing::reload() {
    const Expected<TlsKeys> keys = read_();
    Expected<std::shared_ptr<const TlsContext>> made = keys ? TlsContext::make(*keys) : tl::unexpected(keys.error());
    if (!made) return stay(made.error());
    said_.clear();
    keys_ = *keys;
    put(std::move(*made));
    sayFaults();
}

/// A list of who is revoked counts whatever is wrong with the other files.
void KeyRing::stay(const Error& why) {
    std::string words = "the keys stay as they were", faults = why.message;
    if (current()->mayAccept()) {
        const std::size_t revoked = keys_.revoked.size(), tokens = keys_.tokens.size();
        const std::vector<std::string> unread = KeyFolder(folder_).takeRevoked(keys_);
        if (revoked != keys_.revoked.size() || tokens != keys_.tokens.size())
            if (Expected<std::shared_ptr<const TlsContext>> made = TlsContext::make(keys_)) put(std::move(*made));
        words += unread.empty() ? ", but for what is revoked" : ", and not all that is revoked counts";
        for (const std::string& fault : unread)
            if (fault != why.message) faults += "; " + fault;
    }
    words = fmt::format("{}: {}: {}", folder_, words, faults);
    if (words != said_) onWords_(words);
    said_ = std::move(words);
}

void KeyRing::put(std::shared_ptr<const TlsContext> made) {
    {
        const Turn::Hold hold = turn_.take();
        current_ = std::move(made);
    }
    onChange_();
}

/// A server's affair: who has one key renews it when told to.
void KeyRing::sayFaults() const {
    const auto now = std::chrono::system_clock::now();
    const std::shared_ptr<const TlsContext> keys = current();
    if (!keys->mayAccept()) return;
    for (const KeyEnd& end : keys->endsSoon(now)) onWords_(toText(end, now));
    for (const std::string& fault : keys->faults()) onWords_(fmt::format("{}: {}", folder_, fault));
}

namespace {

Expected<CurrentKeys> watched(const std::string& folder, KeyRing::Read read) {
    Expected<std::unique_ptr<KeyRing>> opened = KeyRing::open(folder, std::move(read));
    if (!opened) return tl::unexpected(opened.error());
    const std::shared_ptr<KeyRing> ring = std::move(*opened);
    ring->watch([] {}, [](const std::string&) {});
    return [ring] { return ring->current(); };
}

}  // namespace

Expected<CurrentKeys> keysThatStay(TlsKeys keys) {
    const Expected<std::shared_ptr<const TlsContext>> made = TlsContext::make(std::move(keys));
    if (!made) return tl::unexpected(made.error());
    return [context = *made] { return context; };
}

Expected<CurrentKeys> keysOfHost(const std::string& folder, const std::string& name) {
    const KeyFolder files(folder);
    return watched(files.path(), [files, name] { return files.ofHost(name); });
}

Expected<CurrentKeys> keysOfPerson(const std::string& place) {
    constexpr std::string_view kBefore = "person-", kBehind = ".pem";
    const std::filesystem::path path(place);
    const std::string file = path.filename();
    std::string name;
    const bool one = file.starts_with(kBefore) && file.ends_with(kBehind);
    if (one) name = file.substr(kBefore.size(), file.size() - kBefore.size() - kBehind.size());
    const std::string above = path.parent_path().empty() ? "." : path.parent_path().string();
    const KeyFolder files(one ? above : place);
    return watched(files.path(), [files, name] { return files.ofPerson(name); });
}

}  // namespace tessera
