#include "common/tls/KeyRing.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <string_view>
#include <utility>

namespace tessera {

Expected<std::unique_ptr<KeyRing>> KeyRing::of(TlsKeys keys) {
    Expected<std::shared_ptr<const TlsContext>> made = TlsContext::make(std::move(keys));
    if (!made) return tl::unexpected(made.error());
    std::unique_ptr<KeyRing> ring(new KeyRing);
    ring->current_ = std::move(*made);
    return ring;
}

Expected<std::unique_ptr<KeyRing>> KeyRing::open(const std::string& folder, Read read) {
    // Watched before it is read: what changes in between is seen.
    const int notices = ::inotify_init1(IN_CLOEXEC | IN_NONBLOCK);
    const bool watched =
        notices >= 0 && ::inotify_add_watch(notices, folder.c_str(), IN_MOVED_TO | IN_CLOSE_WRITE | IN_DELETE) >= 0;
    const int why = errno;
    Expected<TlsKeys> keys = read();
    Expected<std::unique_ptr<KeyRing>> ring = keys ? of(std::move(*keys)) : tl::unexpected(keys.error());
    if (ring && !watched)
        ring =
            fail(ErrorCode::kFailed, fmt::format("{}: its changes cannot be noticed ({})", folder, std::strerror(why)));
    if (!ring) {
        if (notices >= 0) ::close(notices);
        if (!ring.error().message.starts_with(folder)) return failWith(folder, ring.error());
        return ring;
    }
    (*ring)->folder_ = folder;
    (*ring)->read_ = std::move(read);
    (*ring)->notices_ = notices;
    return ring;
}

KeyRing::~KeyRing() {
    rest();
    if (notices_ >= 0) ::close(notices_);
}

void KeyRing::rest() {
    if (!thread_.joinable()) return;
    ::eventfd_write(stop_, 1);
    thread_.join();
    ::close(stop_);
}

void KeyRing::watch(std::function<void()> onChange, std::function<void(const std::string&)> onWords) {
    if (notices_ < 0) return;
    onChange_ = std::move(onChange);
    onWords_ = std::move(onWords);
    stop_ = ::eventfd(0, EFD_CLOEXEC);
    TESSERA_CHECK(stop_ >= 0, "no eventfd can be made");
    thread_ = std::thread([this] { run(); });
}

std::shared_ptr<const TlsContext> KeyRing::current() const {
    const Turn::Hold hold = turn_.take();
    return current_;
}

void KeyRing::run() {
    constexpr int kMoreMayCome = 50;  // ms: several files are written together
    constexpr int kDay = 86'400'000;  // ms
    sayEnds();
    for (bool pending = false;;) {
        std::array<pollfd, 2> wait{pollfd{notices_, POLLIN, 0}, pollfd{stop_, POLLIN, 0}};
        const int count = ::poll(wait.data(), wait.size(), pending ? kMoreMayCome : kDay);
        if (wait[1].revents != 0) return;
        if (count < 0 && errno != EINTR) return;
        if (count == 0 && pending) {
            reload();
            pending = false;
        } else if (count == 0) {
            sayEnds();
        } else if (wait[0].revents != 0) {
            alignas(inotify_event) std::array<char, 4096> notices{};
            while (::read(notices_, notices.data(), notices.size()) > 0) {
            }
            pending = true;
        }
    }
}

void KeyRing::reload() {
    const Expected<TlsKeys> keys = read_();
    Expected<std::shared_ptr<const TlsContext>> made = keys ? TlsContext::make(*keys) : tl::unexpected(keys.error());
    if (!made) return onWords_(fmt::format("{}: the keys stay as they were: {}", folder_, made.error().message));
    {
        const Turn::Hold hold = turn_.take();
        current_ = std::move(*made);
    }
    onChange_();
    sayEnds();
}

/// A server's affair: who has one key renews it when told to.
void KeyRing::sayEnds() const {
    const auto now = std::chrono::system_clock::now();
    const std::shared_ptr<const TlsContext> keys = current();
    if (!keys->mayAccept()) return;
    for (const KeyEnd& end : keys->endsSoon(now)) onWords_(toText(end, now));
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
