#include "server/door/DoorWire.h"

#include <sys/resource.h>
#include <boost/asio/post.hpp>

#include <algorithm>
#include <utility>

#include "common/net/TcpTransport.h"
#include "server/door/DoorLink.h"

namespace tessera {

namespace {

constexpr int kNice = 10;
/// Of a link that the door has not come to yet: beyond it TCP holds the server back.
constexpr std::size_t kMaxUntakenBytes = std::size_t{2} << 20;

}  // namespace

void standBehindFrames() {
    (void)::setpriority(PRIO_PROCESS, 0, kNice);  // Linux: of this thread
}

DoorWire::DoorWire(boost::asio::io_context& io) : io_(io), clock_(io) {
    TransportLimits limits = ApplicationSession::limits();
    limits.maxUntakenBytes = kMaxUntakenBytes;
    limits.onThread = standBehindFrames;
    transport_ = std::make_unique<TcpTransport>(std::move(limits), [this](LinkEvent event) {
        boost::asio::post(io_, [this, event = std::move(event)] { deliver(event); });
    });
}

DoorWire::~DoorWire() {
    for (const auto& [key, weak] : links_)
        if (const std::shared_ptr<DoorLink> link = weak.lock()) link->abandon();
}

void DoorWire::serve(const std::shared_ptr<DoorLink>& link) {
    links_.insert_or_assign(link.get(), link);  // one that is gone may have lain at the same address
    wakeBy(link->nextDeadline());
}

void DoorWire::deliver(const LinkEvent& event) {
    for (auto at = links_.begin(); at != links_.end();) {
        const std::shared_ptr<DoorLink> link = at->second.lock();
        if (link && link->owns(linkOf(event))) {
            link->on(event);
            wakeBy(link->nextDeadline());
            break;
        }
        at = link ? std::next(at) : links_.erase(at);
    }
    if (const auto* received = std::get_if<link_event::Received>(&event.what))
        transport_->taken(received->link, received->payload.size());
}

void DoorWire::advance() {
    wakes_ = TimePoint::max();
    const TimePoint now = clockNow();
    TimePoint next = TimePoint::max();
    for (const auto& [key, weak] : std::map(links_))  // what ends may dial anew
        if (const std::shared_ptr<DoorLink> link = weak.lock()) {
            link->advance(now);
            next = std::min(next, link->nextDeadline());
        }
    if (next != TimePoint::max()) wakeBy(next);
}

void DoorWire::wakeBy(TimePoint due) {
    if (due >= wakes_) return;
    wakes_ = due;
    clock_.expires_at(due);
    clock_.async_wait([this](boost::system::error_code stopped) {
        if (!stopped) advance();
    });
}

}  // namespace tessera
