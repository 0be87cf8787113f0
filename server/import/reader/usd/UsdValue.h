/// A value of a USD file, whatever its type: numbers, words, or a dictionary.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace tessera {

/// Numbers stand one after another, `width` of them an element: 3 of a point3f, 16 of a matrix4d (row by row, as row
/// vectors are multiplied with it). A quaternion's are x y z w behind each other, as crates have them. Bools are 0 and
/// 1; whole numbers of more than 32 bits are doubles.
struct UsdValue {
    using Words = std::vector<std::string>;  ///< tokens, strings, paths, asset paths
    using Dictionary = std::map<std::string, UsdValue, std::less<>>;

    /// No alternative: the value is blocked (`None`), weaker ones do not count either.
    std::variant<std::monostate, std::vector<std::int32_t>, std::vector<float>, std::vector<double>, Words,
                 std::shared_ptr<const Dictionary>>
        data;
    std::uint32_t width = 1;
    bool array = false;

    [[nodiscard]] bool blocked() const { return data.index() == 0; }
    /// All numbers, of all elements; of words as many as there are.
    [[nodiscard]] std::size_t count() const;
    /// The first number; nothing: it has none.
    [[nodiscard]] std::optional<double> number() const;
    [[nodiscard]] bool truth(bool otherwise) const { return number().value_or(otherwise ? 1 : 0) != 0; }
    /// The first word; null: it has none.
    [[nodiscard]] const std::string* word() const;
    [[nodiscard]] const Words* words() const { return std::get_if<Words>(&data); }
    [[nodiscard]] const Dictionary* dictionary() const;

    /// All numbers as this type, int32, float or double; those that do not fit are the nearest that do. Of words: none.
    template <typename Number>
    [[nodiscard]] std::vector<Number> numbers() const;
    /// Bytes of memory behind it, roughly.
    [[nodiscard]] std::size_t bytes() const;
};

using UsdValuePtr = std::shared_ptr<const UsdValue>;

/// What a type's name says of its values: "point3f[]", "matrix4d", "token".
struct UsdType {
    enum class Store { kIntegers, kFloats, kDoubles, kWords };
    Store store = Store::kDoubles;
    std::uint32_t width = 1;
    bool array = false;
    bool quaternion = false;  ///< text has the real part first
};
[[nodiscard]] UsdType usdTypeOf(const std::string& name);

}  // namespace tessera
