/// A row of many large things that grows without moving those that are there.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

namespace tessera {

/// Where a vector grows it copies all that it holds, which takes longer than a frame where that is a million places.
/// Here a page comes now and then. References stay good until `clear`.
template <typename T>
class PagedRow {
public:
    PagedRow() = default;
    PagedRow(const PagedRow&) = delete;
    PagedRow& operator=(const PagedRow&) = delete;
    PagedRow(PagedRow&&) = default;
    PagedRow& operator=(PagedRow&&) = default;

    [[nodiscard]] std::size_t size() const { return size_; }
    [[nodiscard]] T& operator[](std::size_t index) { return pages_[index / kPage][index % kPage]; }
    [[nodiscard]] const T& operator[](std::size_t index) const { return pages_[index / kPage][index % kPage]; }
    /// `size` at least as many as there are; new ones are as T begins.
    void growTo(std::size_t size) {
        while (pages_.size() * kPage < size) pages_.push_back(std::make_unique<T[]>(kPage));
        size_ = size;
    }
    void clear() {
        pages_.clear();
        size_ = 0;
    }

private:
    static constexpr std::size_t kPage = 1024;
    std::vector<std::unique_ptr<T[]>> pages_;
    std::size_t size_ = 0;
};

}  // namespace tessera
