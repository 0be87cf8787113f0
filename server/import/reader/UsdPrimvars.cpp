#include "server/import/reader/UsdPrimvars.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace tessera {
namespace {

using Per = UsdPrimvar::Per;

/// What is inherited is kept for each prim.
constexpr std::size_t kMostInherited = 64;

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

std::shared_ptr<const UsdInherited> usdInheritedBelow(const UsdComposedPrim& prim,
                                                      const std::shared_ptr<const UsdInherited>& above,
                                                      UsdRemarks& remarks) {
    constexpr std::string_view kPrefix = "primvars:", kIndices = ":indices";
    std::set<std::string_view> names;
    for (const UsdOpinion& opinion : prim.opinions())
        for (auto said = opinion.prim->properties.lower_bound(kPrefix);
             said != opinion.prim->properties.end() && said->first.starts_with(kPrefix); ++said)
            if (!said->first.ends_with(kIndices)) names.insert(said->first);
    if (names.empty()) return above;
    auto below = above ? std::make_shared<UsdInherited>(*above) : std::make_shared<UsdInherited>();
    for (const std::string_view name : names) {
        if (below->size() >= kMostInherited) {
            remarks.add(fmt::format("values beyond the first {} that all below inherit are left out", kMostInherited),
                        prim.path());
            break;
        }
        const std::string indices = std::string(name) + std::string(kIndices);
        below->erase(std::string(name));
        below->erase(indices);
        // What varies over a prim is that one's own.
        const UsdValue* interpolation = prim.metadata(name, "interpolation");
        if (interpolation != nullptr && interpolation->word() != nullptr && *interpolation->word() != "constant")
            continue;
        for (const std::string& each : {std::string(name), indices})
            if (std::optional<UsdAttribute> value = prim.attribute(each); value && value->value)
                below->emplace(each, std::move(*value));
    }
    return below;
}

std::string usdPrintOf(const UsdInherited* inherited) {
    std::string print;
    if (inherited != nullptr)
        for (const auto& [name, attribute] : *inherited)
            print += fmt::format("\n{} {}", name, fmt::ptr(attribute.value.get()));
    return print;
}

std::optional<UsdAttribute> usdPrimvarOf(const UsdComposedPrim& prim, const UsdInherited* inherited,
                                         const std::string& name) {
    std::optional<UsdAttribute> own = prim.attribute(name);
    if ((own && own->value) || inherited == nullptr) return own;
    const auto found = inherited->find(name);
    return found == inherited->end() ? own : found->second;
}

std::optional<UsdPrimvar> UsdPrimvar::of(const UsdComposedPrim& prim, const UsdInherited* inherited,
                                         const std::string& name, std::size_t width, const UsdElements& elements,
                                         UsdRemarks& remarks) {
    const std::optional<UsdAttribute> attribute = usdPrimvarOf(prim, inherited, name);
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
    const std::optional<UsdAttribute> own = prim.attribute(name);
    const bool isOwn = own && own->value;
    if (const std::optional<UsdAttribute> said = usdPrimvarOf(prim, isOwn ? nullptr : inherited, name + ":indices");
        said && said->value)
        indices = said->value->numbers<std::int32_t>();
    const std::size_t said = indices.empty() ? have : indices.size();
    // Normals of their own name are per vertex where nobody says, other values the same for all.
    std::optional<Per> per;
    const UsdValue* interpolation = prim.metadata(name, "interpolation");
    if (interpolation != nullptr && interpolation->word() != nullptr) per = usdPerOf(*interpolation->word());
    if (per && elements.varyingPerCorner && *interpolation->word() == "varying") per = Per::kCorner;
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
