/// Where a prim of USD stands: its xformOps, at one time or over all.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/math/Types.h"
#include "server/import/reader/usd/UsdStage.h"

namespace tessera {

/// The numbers of an attribute at a time of the stage: linear between samples, the outermost beyond them. No numbers:
/// none. A quaternion's (four of a type of quaternions) keep their length between samples.
[[nodiscard]] std::vector<double> usdNumbersAt(const UsdAttribute& attribute, double time);

/// A prim's own transform: the product of its operations, in their order.
class UsdTransform {
public:
    /// Operations that are no sound numbers are left out, and named.
    UsdTransform(const UsdComposedPrim& prim, UsdRemarks& remarks);

    /// Whether the parents' transforms are not to count.
    [[nodiscard]] bool resetsStack() const { return resetsStack_; }
    [[nodiscard]] bool moves() const { return moves_; }
    /// At a time of the stage; without one at the first. parent_T_prim.
    [[nodiscard]] Affine3d at(std::optional<double> time = std::nullopt) const;
    /// All times at which something has a sample, and, where something turns far from one to the next, so many between
    /// that a rotation along the shorter way, as Tessera's animations go, is what the file says.
    struct KeyTimes {
        std::vector<double> times;
        bool cut = false;        ///< there are more than `most`
        bool turnsLost = false;  ///< something turns farther than what was left of `between`
    };
    /// `between`: how many keys that no sample has may be made; becomes what is left of these.
    [[nodiscard]] KeyTimes keyTimes(std::size_t most, std::size_t& between) const;

private:
    enum class Kind : std::uint8_t { kTranslate, kScale, kRotate, kOrient, kMatrix };
    struct Operation {
        Kind kind = Kind::kTranslate;
        std::string axes;  ///< "X", or "XYZ": the first turns first
        bool inverse = false;
        UsdAttribute attribute;
    };
    [[nodiscard]] static std::optional<Affine3d> valueOf(const Operation& operation, std::optional<double> time);

    std::vector<Operation> operations_;
    bool resetsStack_ = false, moves_ = false;
};

}  // namespace tessera
