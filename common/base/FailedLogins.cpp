#include "common/base/FailedLogins.h"

#include <algorithm>

namespace tessera {

FailedLogins::Verdict FailedLogins::failed(SourceAddress from, TimePoint now) {
    Address& address = addressOf(from);
    if (now - address.last >= limits_.forgotten) address.failures = 0;
    address.last = now;
    // Beyond the longest wait nothing changes, and counting on would end some day.
    constexpr std::size_t kMostDoublings = 20;
    address.failures = std::min(address.failures + 1, limits_.atOnce + kMostDoublings);
    if (address.failures <= limits_.atOnce) return {};
    Verdict verdict;
    if (address.failures == limits_.atOnce + 1 && (!told_ || now >= *told_ + limits_.tells)) {
        verdict.begins = true;
        told_ = now;
    }
    if (address.waiting >= limits_.maxWaitingOfOne || waiting_ >= limits_.maxWaiting) {
        verdict.close = true;
        return verdict;
    }
    verdict.wait = std::min(limits_.first * (1 << (address.failures - limits_.atOnce - 1)), limits_.longest);
    ++address.waiting;
    ++waiting_;
    verdict.ticket.emplace(*this, from);
    return verdict;
}

/// At the end of the row.
FailedLogins::Address& FailedLogins::addressOf(SourceAddress from) {
    const auto found = addresses_.find(from);
    if (found != addresses_.end()) {
        byTime_.splice(byTime_.end(), byTime_, found->second.place);
        return found->second;
    }
    if (addresses_.size() >= limits_.maxAddresses) {
        addresses_.erase(byTime_.front());
        byTime_.pop_front();
    }
    Address& address = addresses_[from];
    address.place = byTime_.insert(byTime_.end(), from);
    return address;
}

void FailedLogins::ended(SourceAddress from) {
    --waiting_;
    // It may have been forgotten meanwhile, and have come anew.
    const auto found = addresses_.find(from);
    if (found != addresses_.end() && found->second.waiting > 0) --found->second.waiting;
}

std::string describeSlowed(SourceAddress from) {
    return "wrong tokens come from " + toString(from) + " again and again: it is refused more and more slowly";
}

}  // namespace tessera
