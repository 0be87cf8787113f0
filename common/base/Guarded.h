/// A small value that several threads look at and change.
#pragma once

#include <mutex>
#include <utility>

namespace tessera {

/// One thread at a time has it. For what is told again and again, where only the newest counts; else a Channel.
template <typename T>
class Guarded {
public:
    /// What `use` returns, which is called with the value. It takes no other Guarded.
    template <typename Use>
    auto with(Use&& use) {
        const std::scoped_lock lock(mutex_);
        return std::forward<Use>(use)(value_);
    }
    [[nodiscard]] T copy() const {
        const std::scoped_lock lock(mutex_);
        return value_;
    }

private:
    mutable std::mutex mutex_;
    T value_ = {};
};

}  // namespace tessera
