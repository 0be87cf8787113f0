#include "server/import/reader/usd/UsdValue.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>
#include <type_traits>

namespace tessera {
namespace {

template <typename To, typename From>
To nearest(From number) {
    if constexpr (std::is_integral_v<To> && std::is_floating_point_v<From>) {
        if (!(number == number)) return 0;
        return static_cast<To>(
            std::clamp<double>(number, std::numeric_limits<To>::min(), std::numeric_limits<To>::max()));
    } else {
        return static_cast<To>(number);
    }
}

}  // namespace

std::size_t UsdValue::count() const {
    return std::visit(
        [](const auto& held) -> std::size_t {
            using Held = std::decay_t<decltype(held)>;
            if constexpr (std::is_same_v<Held, std::monostate>)
                return 0;
            else if constexpr (std::is_same_v<Held, std::shared_ptr<const Dictionary>>)
                return held ? held->size() : 0;
            else
                return held.size();
        },
        data);
}

std::optional<double> UsdValue::number() const {
    if (const auto* integers = std::get_if<std::vector<std::int32_t>>(&data); integers && !integers->empty())
        return integers->front();
    if (const auto* floats = std::get_if<std::vector<float>>(&data); floats && !floats->empty()) return floats->front();
    if (const auto* doubles = std::get_if<std::vector<double>>(&data); doubles && !doubles->empty())
        return doubles->front();
    return std::nullopt;
}

const std::string* UsdValue::word() const {
    const Words* all = words();
    return all != nullptr && !all->empty() ? &all->front() : nullptr;
}

const UsdValue::Dictionary* UsdValue::dictionary() const {
    const auto* held = std::get_if<std::shared_ptr<const Dictionary>>(&data);
    return held != nullptr ? held->get() : nullptr;
}

template <typename Number>
std::vector<Number> UsdValue::numbers() const {
    return std::visit(
        [](const auto& held) -> std::vector<Number> {
            using Held = std::decay_t<decltype(held)>;
            if constexpr (std::is_same_v<Held, std::vector<Number>>) {
                return held;
            } else if constexpr (std::is_same_v<Held, std::vector<std::int32_t>> ||
                                 std::is_same_v<Held, std::vector<float>> ||
                                 std::is_same_v<Held, std::vector<double>>) {
                std::vector<Number> out(held.size());
                std::transform(held.begin(), held.end(), out.begin(), [](auto n) { return nearest<Number>(n); });
                return out;
            } else {
                return {};
            }
        },
        data);
}
template std::vector<std::int32_t> UsdValue::numbers() const;
template std::vector<float> UsdValue::numbers() const;
template std::vector<double> UsdValue::numbers() const;

std::size_t UsdValue::bytes() const {
    return std::visit(
        [](const auto& held) -> std::size_t {
            using Held = std::decay_t<decltype(held)>;
            std::size_t sum = sizeof(UsdValue);
            if constexpr (std::is_same_v<Held, Words>) {
                for (const std::string& word : held) sum += sizeof(word) + word.size();
            } else if constexpr (std::is_same_v<Held, std::shared_ptr<const Dictionary>>) {
                if (held)
                    for (const auto& [key, value] : *held) sum += 64 + key.size() + value.bytes();
            } else if constexpr (!std::is_same_v<Held, std::monostate>) {
                sum += held.size() * sizeof(typename Held::value_type);
            }
            return sum;
        },
        data);
}

UsdType usdTypeOf(const std::string& name) {
    UsdType type;
    std::string_view word = name;
    if (word.ends_with("[]")) {
        type.array = true;
        word.remove_suffix(2);
    }
    using Store = UsdType::Store;
    if (word == "token" || word == "string" || word == "asset" || word == "pathExpression" || word == "opaque" ||
        word == "group") {
        type.store = Store::kWords;
        return type;
    }
    if (word == "bool" || word == "uchar" || word == "int") {
        type.store = Store::kIntegers;
        return type;
    }
    if (word == "uint" || word == "int64" || word == "uint64" || word == "double" || word == "timecode") return type;
    if (word == "float" || word == "half") {
        type.store = Store::kFloats;
        return type;
    }
    if (word == "frame4d") {
        type.width = 16;
        return type;
    }
    // "color3f", "quath", "matrix4d", "int2", "float3": a stem, perhaps a number, perhaps the letter of a store.
    const std::size_t digit = word.find_first_of("234");
    const char last = word.empty() ? ' ' : word.back();
    if (word.starts_with("quat")) {
        type.width = 4;
        type.quaternion = true;
        type.store = last == 'd' ? Store::kDoubles : Store::kFloats;
        return type;
    }
    if (digit == std::string_view::npos) {
        type.store = Store::kWords;  // of whoever made the type
        return type;
    }
    type.width = static_cast<std::uint32_t>(word[digit] - '0');
    const std::string_view stem = word.substr(0, digit);
    if (stem == "matrix") {
        type.width *= type.width;
    } else if (stem == "int") {
        type.store = Store::kIntegers;
    } else if (stem == "float" || stem == "half" || last == 'f' || last == 'h') {
        type.store = Store::kFloats;
    }
    return type;
}

}  // namespace tessera
