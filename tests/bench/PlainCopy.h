/// Copies a list's ids and values into memory that is there already: the least that any way of passing them on can
/// cost.
#pragma once

#include <cstddef>
#include <cstring>
#include <type_traits>
#include <vector>

#include "common/base/Error.h"
#include "common/change/ChangeList.h"

namespace tessera {

/// For lists of numbers and refs; text and blobs are not plain memory.
class PlainCopy {
public:
    explicit PlainCopy(const ChangeList& list) : list_(list) {
        forEach([this](const void*, std::size_t size) { bytes_ += size; });
        to_.resize(bytes_);
    }
    void operator()() {
        std::byte* at = to_.data();
        forEach([&at](const void* from, std::size_t size) {
            std::memcpy(at, from, size);
            at += size;
        });
    }
    [[nodiscard]] std::size_t sizeBytes() const { return bytes_; }

private:
    template <typename Take>
    void forEach(Take&& take) const {
        const auto array = [&take](const auto& values) {
            using Value = typename std::decay_t<decltype(values)>::value_type;
            if constexpr (std::is_trivially_copyable_v<Value>)
                take(values.data(), values.size() * sizeof(Value));
            else
                TESSERA_CHECK(values.empty(), "a plain copy of values that are not plain");
        };
        array(list_.creations);
        array(list_.placements);
        for (const FieldColumn& column : list_.columns) {
            array(column.ids);
            std::visit(array, column.values);
        }
        array(list_.destructions);
    }

    const ChangeList& list_;
    std::size_t bytes_ = 0;
    std::vector<std::byte> to_;
};

}  // namespace tessera
