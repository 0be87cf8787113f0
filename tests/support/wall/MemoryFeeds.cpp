#include "tests/support/wall/MemoryFeeds.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/HostRange.h"

namespace tessera::simulation {

/// The feeds of one program.
class MemoryFeeds::Own final : public Feeds {
public:
    explicit Own(MemoryFeeds& all) : all_(all) {}

    [[nodiscard]] Expected<std::uint16_t> listen(const Address& address,
                                                 std::function<void(const Datagram&)> onDatagram) override {
        const std::uint16_t port = address.port != 0 ? address.port : ++all_.lastPort_;
        std::weak_ptr<Listener>& place = all_.listeners_[port];
        if (!place.expired())
            return fail(ErrorCode::kNetwork, fmt::format("cannot listen for datagrams at {}", toString(address)));
        place = listening_.emplace_back(std::make_shared<Listener>(std::move(onDatagram)));
        return port;
    }
    void dial(const Address& address, Stream stream) override {
        const auto& dialled = dialling_.emplace_back(std::make_shared<Dialled>(Dialled{.stream = std::move(stream)}));
        dialled->pause = dialled->stream.firstPause;
        all_.dial(address.port, dialled);
    }

private:
    MemoryFeeds& all_;
    std::vector<std::shared_ptr<Listener>> listening_;
    std::vector<std::shared_ptr<Dialled>> dialling_;
};

MakeFeeds MemoryFeeds::make() {
    return [this] { return std::make_unique<Own>(*this); };
}

void MemoryFeeds::send(std::uint16_t port, ByteSpan bytes, const std::string& from) {
    const Expected<HostRange> sender = parseHostRange(from);
    if (!sender) throw Violation(sender.error().message);
    timeline_.after(kOnItsWay, [this, port, bytes = Bytes(bytes.begin(), bytes.end()), sender = sender->first] {
        if (const auto listener = listeners_[port].lock())
            listener->onDatagram({.bytes = bytes, .from = sender, .at = timeline_.now()});
    });
}

void MemoryFeeds::dial(std::uint16_t port, const std::shared_ptr<Dialled>& dialled) {
    timeline_.after(kOnItsWay, [this, port, weak = std::weak_ptr(dialled)] {
        const std::shared_ptr<Dialled> dialled = weak.lock();
        if (!dialled) return;
        Served& server = served_[port];
        if (!server.there) return lose(port, dialled, {ErrorCode::kNetwork, "Connection refused"});
        dialled->open = true;
        server.dialled.push_back(dialled);
        const Bytes first = dialled->stream.opened();
        server.heard.insert(server.heard.end(), first.begin(), first.end());
        watch(port, dialled);
    });
}

void MemoryFeeds::lose(std::uint16_t port, const std::shared_ptr<Dialled>& dialled, const Error& why) {
    dialled->open = false;
    ++dialled->attempt;
    dialled->stream.lost(why);
    timeline_.after(dialled->pause, [this, port, weak = std::weak_ptr(dialled)] {
        if (const std::shared_ptr<Dialled> again = weak.lock()) dial(port, again);
    });
    dialled->pause = std::min(2 * dialled->pause, dialled->stream.longestPause);
}

/// A stream that says nothing for its time is dialled again.
void MemoryFeeds::watch(std::uint16_t port, const std::shared_ptr<Dialled>& dialled) {
    timeline_.after(dialled->stream.silence, [this, port, weak = std::weak_ptr(dialled), attempt = ++dialled->attempt] {
        const std::shared_ptr<Dialled> silent = weak.lock();
        if (silent && silent->open && silent->attempt == attempt)
            lose(port, silent, {ErrorCode::kNetwork, "is silent"});
    });
}

void MemoryFeeds::serve(std::uint16_t port, bool there) {
    Served& server = served_[port];
    server.there = there;
    if (there) return;
    server.heard.clear();
    for (const auto& weak : std::exchange(server.dialled, {}))
        if (const std::shared_ptr<Dialled> dialled = weak.lock(); dialled && dialled->open)
            lose(port, dialled, {ErrorCode::kNetwork, "has closed the connection"});
}

bool MemoryFeeds::say(std::uint16_t port, ByteSpan bytes) {
    bool anybody = false;
    for (const auto& weak : served_[port].dialled) {
        const std::shared_ptr<Dialled> dialled = weak.lock();
        if (!dialled || !dialled->open) continue;
        anybody = true;
        dialled->pause = dialled->stream.firstPause;
        watch(port, dialled);
        if (const Expected<void> taken = dialled->stream.received(bytes, timeline_.now()); !taken)
            lose(port, dialled, taken.error());
    }
    return anybody;
}

}  // namespace tessera::simulation
