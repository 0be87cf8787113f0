/// What triangles of a 3MF look like: their properties looked up, mixed and laid over each other.
#pragma once

#include <compare>
#include <map>
#include <string>
#include <unordered_map>
#include <vector>

#include "server/import/reader/PrintedMesh.h"
#include "server/import/reader/printing/ThreeMfModel.h"

namespace tessera {

/// What some triangles have alike, and becomes a material.
struct ThreeMfLook {
    enum class Kind : std::uint8_t {
        kPlain,    ///< nothing is said
        kBase,     ///< a base material: `of` its group, `index` in it
        kColor,    ///< one colour: `index`, as 0xRRGGBBAA
        kColors,   ///< those of their corners
        kPicture,  ///< the texture `of`, times the colours of their corners
    };
    Kind kind = Kind::kPlain;
    bool isTranslucent = false, hasTwoSides = false;
    std::uint32_t of = kNoNumber, index = 0;

    auto operator<=>(const ThreeMfLook&) const = default;
};

/// Of one part of a package.
class ThreeMfLooks {
public:
    ThreeMfLooks(const ThreeMfModel& model, PrintingRemark remark) : model_(model), remark_(std::move(remark)) {}

    /// The object's triangles with what its corners have, and the looks that their numbers mean. The object's own
    /// arrays are gone then.
    [[nodiscard]] PrintedMesh meshOf(ThreeMfObject& object, std::vector<ThreeMfLook>& looks);

private:
    /// What one corner has.
    struct Value {
        std::uint32_t color = 0xffffffff;
        bool isSaid = false;
        std::uint32_t base = kNoNumber, index = 0;  ///< the base material alone that it is
        std::uint32_t texture = kNoNumber;
        float u = 0, v = 0;
    };
    struct Resolved {
        std::uint32_t pid = kNoNumber;
        const ThreeMfProperties* properties = nullptr;
    };
    [[nodiscard]] Value valueOf(std::uint32_t pid, std::uint32_t index, Resolved& last);
    /// Of what is mixed of very many each once, whatever number of corners has it.
    [[nodiscard]] Value mixedOf(std::uint32_t pid, const ThreeMfProperties& properties, std::uint32_t index);
    [[nodiscard]] Value mixtureOf(const ThreeMfProperties& properties, std::uint32_t index) const;
    [[nodiscard]] Value layersOf(const ThreeMfProperties& properties, std::uint32_t index);
    [[nodiscard]] Value over(const Value& below, const Value& above, bool multiplies) const;

    const ThreeMfModel& model_;
    PrintingRemark remark_;
    std::unordered_map<std::uint64_t, Value> mixed_;  ///< by the number of the properties and the index
};

}  // namespace tessera
