/// Values that vary over a mesh of USD: "primvars", which stand once, per face, per vertex, or per corner of a face.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/import/reader/usd/UsdStage.h"

namespace tessera {

// Of an attribute what is wanted of it, or what there is otherwise: a finite number, a word, all numbers.
[[nodiscard]] double usdNumber(const UsdComposedPrim& prim, std::string_view name, double otherwise);
[[nodiscard]] std::string usdWord(const UsdComposedPrim& prim, std::string_view name, const char* otherwise);
[[nodiscard]] std::vector<double> usdNumbers(const UsdComposedPrim& prim, std::string_view name);

/// Primvars of prims above that are the same for all that is below, and their indices: "primvars:displayColor".
using UsdInherited = std::map<std::string, UsdAttribute, std::less<>>;
/// Those that hold below a prim; `above`: at it. Null: none.
[[nodiscard]] std::shared_ptr<const UsdInherited> usdInheritedBelow(const UsdComposedPrim& prim,
                                                                    const std::shared_ptr<const UsdInherited>& above,
                                                                    UsdRemarks& remarks);
/// Which values they are: the same text where they are the same.
[[nodiscard]] std::string usdPrintOf(const UsdInherited* inherited);
/// A primvar of the prim itself, or else one that it inherits.
[[nodiscard]] std::optional<UsdAttribute> usdPrimvarOf(const UsdComposedPrim& prim, const UsdInherited* inherited,
                                                       const std::string& name);

/// How many faces, vertices and corners what they stand on has.
struct UsdElements {
    std::size_t faces = 0, vertices = 0, corners = 0;
    bool varyingPerCorner = false;  ///< "varying" means that; else it means per vertex
};

/// One of these; all values are there.
class UsdPrimvar {
public:
    enum class Per : std::uint8_t { kAll, kFace, kVertex, kCorner };

    /// Values as they are, without indices.
    UsdPrimvar(std::vector<float> values, std::size_t width, Per per)
        : values_(std::move(values)), width_(width), per_(per) {}
    /// "points", "normals" or "primvars:st" of the prim, `width` numbers each. Nothing where there is none; nothing and
    /// a remark where its numbers, or its indices, are not as many as its interpolation says.
    [[nodiscard]] static std::optional<UsdPrimvar> of(const UsdComposedPrim& prim, const UsdInherited* inherited,
                                                      const std::string& name, std::size_t width,
                                                      const UsdElements& elements, UsdRemarks& remarks);

    /// Of a corner of a face, `width` numbers.
    [[nodiscard]] const float* at(std::size_t face, std::size_t vertex, std::size_t corner) const {
        const std::size_t element = per_ == Per::kAll      ? 0
                                    : per_ == Per::kFace   ? face
                                    : per_ == Per::kVertex ? vertex
                                                           : corner;
        return values_.data() + width_ * (indices_.empty() ? element : static_cast<std::size_t>(indices_[element]));
    }
    [[nodiscard]] Per per() const { return per_; }
    [[nodiscard]] std::size_t width() const { return width_; }

private:
    std::vector<float> values_;
    std::vector<std::int32_t> indices_;  ///< of values, by element; empty: the values as they stand
    std::size_t width_;
    Per per_;
};

}  // namespace tessera
