/// Which requests for images an answer is taken for.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>

namespace tessera {

/// The newest `kRemembered` that were made: what comes for any other is passed over. One owner.
class ImageCalls {
public:
    static constexpr std::size_t kRemembered = 64;

    void made(std::uint64_t request) {
        newest_.push_back(request);
        if (newest_.size() > kRemembered) newest_.pop_front();
    }
    [[nodiscard]] bool knows(std::uint64_t request) const {
        return std::ranges::find(newest_, request) != newest_.end();
    }

private:
    std::deque<std::uint64_t> newest_;
};

}  // namespace tessera
