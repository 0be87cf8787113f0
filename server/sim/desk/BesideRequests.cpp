#include "server/sim/desk/BesideRequests.h"

#include <utility>

namespace tessera {

ServerActions BesideRequests::ask(const Asker& asker, std::size_t bytes, std::function<void()> begin) {
    const auto known = waiting_.find(asker.connection);
    if (known != waiting_.end() &&
        (known->second.requests.size() >= kMostOfOne || known->second.bytes + bytes > kMostBytesOfOne))
        return answers_.to(asker, fail(ErrorCode::kLimit,
                                       "requests of this application that take long are open already; "
                                       "try again later"));
    Queue& queue = waiting_[asker.connection];
    queue.requests.push_back({bytes, std::move(begin)});
    queue.bytes += bytes;
    goOn();
    return {};
}

void BesideRequests::done() {
    busy_ = false;
    goOn();
}

void BesideRequests::goOn() {
    if (busy_ || waiting_.empty()) return;
    auto next = waiting_.upper_bound(last_);
    if (next == waiting_.end()) next = waiting_.begin();
    last_ = next->first;
    const Waiting one = std::move(next->second.requests.front());
    next->second.requests.pop_front();
    next->second.bytes -= one.bytes;
    if (next->second.requests.empty()) waiting_.erase(next);
    busy_ = true;
    one.begin();
}

}  // namespace tessera
