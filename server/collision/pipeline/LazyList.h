/// Lists that a step can make, and makes when somebody asks for them.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

namespace tessera {

/// Reads like a vector. What it holds is known by number at once and made by the first who looks; copies share that.
/// Whoever makes them lets go of those that nobody wants to see before what they would be made from changes
/// (LateItems::makeNow for those that somebody still holds). One thread at a time, as whoever makes them.
template <typename T>
class LazyList {
public:
    struct LateItems {
        std::size_t size = 0;
        std::function<std::vector<T>()> make;  ///< null: made
        std::vector<T> items;

        void makeNow() {
            if (make) items = std::exchange(make, nullptr)();
            size = items.size();
        }
        /// Whoever holds them has none.
        void forget() {
            if (!std::exchange(make, nullptr)) return;
            size = 0;
        }
    };

    LazyList() = default;
    LazyList(std::vector<T> items) : late_(std::make_shared<LateItems>()) {
        late_->size = items.size();
        late_->items = std::move(items);
    }
    explicit LazyList(std::shared_ptr<LateItems> late) : late_(std::move(late)) {}

    [[nodiscard]] std::size_t size() const { return late_ ? late_->size : 0; }
    [[nodiscard]] bool empty() const { return size() == 0; }
    [[nodiscard]] const std::vector<T>& all() const {
        static const std::vector<T> kNone;
        if (!late_) return kNone;
        late_->makeNow();
        return late_->items;
    }
    [[nodiscard]] auto begin() const { return all().begin(); }
    [[nodiscard]] auto end() const { return all().end(); }
    [[nodiscard]] const T& operator[](std::size_t i) const { return all()[i]; }
    [[nodiscard]] const T& front() const { return all().front(); }
    [[nodiscard]] const T& back() const { return all().back(); }

    // Of this list alone, not of its copies.
    [[nodiscard]] T& operator[](std::size_t i) { return own()[i]; }
    [[nodiscard]] T& front() { return own().front(); }
    [[nodiscard]] T& back() { return own().back(); }
    void push_back(T item) {
        own().push_back(std::move(item));
        late_->size = late_->items.size();
    }

private:
    std::vector<T>& own() {
        if (!late_ || late_.use_count() > 1) late_ = std::make_shared<LateItems>(LateItems{size(), nullptr, all()});
        late_->makeNow();
        return late_->items;
    }

    std::shared_ptr<LateItems> late_;
};

}  // namespace tessera
