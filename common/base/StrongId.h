/// Integers that cannot be mistaken for each other.
#pragma once

#include <compare>
#include <cstdint>
#include <functional>

namespace tessera {

template <typename Tag, typename Value = std::uint64_t>
struct StrongId {
    Value value{};

    constexpr StrongId() = default;
    constexpr explicit StrongId(Value v) : value(v) {}
    constexpr auto operator<=>(const StrongId&) const = default;
    /// The one that follows, where ids are counted (sequences, frames).
    [[nodiscard]] constexpr StrongId next() const { return StrongId(static_cast<Value>(value + 1)); }
    /// Zero means "none" wherever an id may be absent.
    [[nodiscard]] constexpr explicit operator bool() const { return value != Value{}; }
};

}  // namespace tessera

template <typename Tag, typename Value>
struct std::hash<tessera::StrongId<Tag, Value>> {
    std::size_t operator()(tessera::StrongId<Tag, Value> id) const noexcept { return std::hash<Value>{}(id.value); }
};
