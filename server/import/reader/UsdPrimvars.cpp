#include "server/import/reader/UsdPrimvars.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace tessera {
namespace {

using Per = UsdPrimvar::Per;

std::optional<Per> usdPerOf(const std::string& interpolation) {
    if (interpolation == "constant") return Per::kAll;
    if (interpolation == "uniform") return Per::kFace;
    if (interpolation == "vertex" || interpolation == "varying") return Per::kVertex;
    if (interpolation == "faceVarying") return Per::kCorner;
    return std::nullopt;
}

std::size_t usdElementCount(Per per, const UsdElements& elements) {
    return per == Per::kAll      ? 1
           : per == Per::kFace   ? elements.faces
           : per == Per::kVertex ? elements.vertices
                                 : elements.corners;
}

}  // namespace

double usdNumber(const UsdComposedPrim& prim, std::string_view name, double otherwise) {
    const std::optional<UsdAttribute> attribute = prim.attribute(name);
    const double said = attribute && attribute->value ? attribute->value->number().value_or(otherwise) : otherwise;
    return std::isfinite(said) ? said : otherwise;
}

std::string usdWord(const UsdComposedPrim& prim, std::string_view name, const char* otherwise) {
    const std::optional<UsdAttribute> attribute = prim.attribute(name);
    return attribute && attribute->value && attribute->value->word() ? *attribute->value->word() : otherwise;
}

std::vector<double> usdNumbers(const UsdComposedPrim& prim, std::string_view name) {
    const std::optional<UsdAttribute> attribute = prim.attribute(name);
    return attribute && attribute->value ? attribute->value->numbers<double>() : std::vector<double>();
}

std::optional<UsdPrimvar> UsdPrimvar::of(const UsdComposedPrim& prim, const std::string& name, std::size_t width,
                                         const UsdElements& elements, UsdRemarks& remarks) {
    const std::optional<UsdAttribute> attribute = prim.attribute(name);
    if (!attribute || !attribute->value) return std::nullopt;
    std::vector<float> values = attribute->value->numbers<float>();
    if (values.empty()) return std::nullopt;
    if (attribute->samples.size() > 1)
        remarks.add("values that change over time are shown as they are first",
                    fmt::format("{}.{}", prim.path(), name));
    const auto leaveOut = [&](const char* why) -> std::optional<UsdPrimvar> {
        remarks.add(fmt::format("values are left out: {}", why), fmt::format("{}.{}", prim.path(), name));
        return std::nullopt;
    };
    if (attribute->value->width != width && !(attribute->value->width == 1 && values.size() % width == 0))
        return leaveOut("they are of another type");
    const std::size_t have = values.size() / width;
    std::vector<std::int32_t> indices;
    if (const std::optional<UsdAttribute> said = prim.attribute(name + ":indices"); said && said->value)
        indices = said->value->numbers<std::int32_t>();
    const std::size_t said = indices.empty() ? have : indices.size();
    // Normals of their own name are per vertex where nobody says, other values the same for all.
    std::optional<Per> per;
    const UsdValue* interpolation = prim.metadata(name, "interpolation");
    if (interpolation != nullptr && interpolation->word() != nullptr) per = usdPerOf(*interpolation->word());
    if (!per) per = name.starts_with("primvars:") ? Per::kAll : Per::kVertex;
    if (said < usdElementCount(*per, elements)) {
        // Files are that leave it unsaid, or say it wrong: as many values as there are of one kind speak for that.
        const auto fits = [&](Per other) { return said == usdElementCount(other, elements); };
        if (fits(Per::kCorner))
            per = Per::kCorner;
        else if (fits(Per::kVertex))
            per = Per::kVertex;
        else if (fits(Per::kFace))
            per = Per::kFace;
        else
            return leaveOut("there are fewer than their interpolation says");
    } else if (*per == Per::kAll && said > 1 && said == elements.vertices) {
        per = Per::kVertex;
    } else if (*per == Per::kAll && said > 1 && said == elements.corners) {
        per = Per::kCorner;
    }
    if (std::ranges::any_of(indices, [&](std::int32_t i) { return i < 0 || static_cast<std::size_t>(i) >= have; }))
        return leaveOut("an index names none of them");
    UsdPrimvar out(std::move(values), width, *per);
    out.indices_ = std::move(indices);
    return out;
}

}  // namespace tessera
