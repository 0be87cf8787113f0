/// What all links of a door to its server have in common: one network thread, and the door's own, which runs them.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>

#include <functional>
#include <map>
#include <memory>

#include "common/net/Transport.h"

namespace tessera {

class DoorLink;

/// Two threads for each of many links would outweigh the frames, however low each stands. All members on the door's
/// thread.
class DoorWire {
public:
    explicit DoorWire(boost::asio::io_context& io);
    ~DoorWire();

    [[nodiscard]] Transport& transport() { return *transport_; }
    /// From now on it is brought the events of what it owns, and advanced when its deadlines come; until it is gone.
    void serve(const std::shared_ptr<DoorLink>& link);

private:
    void deliver(const LinkEvent& event);
    void advance();
    void wakeBy(TimePoint due);

    boost::asio::io_context& io_;
    boost::asio::steady_timer clock_;
    TimePoint wakes_ = TimePoint::max();
    std::map<const DoorLink*, std::weak_ptr<DoorLink>> links_;
    std::unique_ptr<Transport> transport_;
};

/// Frames come first: whatever thread calls it is from then on behind theirs.
void standBehindFrames();

}  // namespace tessera
