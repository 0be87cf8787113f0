/// One USD file in memory, text or crate: what it says, before anything of it is composed with others.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "server/import/reader/usd/UsdValue.h"

namespace tessera {

/// Changes of a weaker list, or, explicit, a list of its own. What text calls `add` counts as appended.
template <typename Item>
struct UsdListOp {
    bool isExplicit = false;
    std::vector<Item> items;  ///< of an explicit one
    std::vector<Item> prepended, appended, deleted;

    [[nodiscard]] bool empty() const { return !isExplicit && prepended.empty() && appended.empty() && deleted.empty(); }
    /// `list`: what weaker opinions say; becomes what they and this one say together.
    void applyTo(std::vector<Item>& list) const {
        if (isExplicit) {
            list = items;
            return;
        }
        const auto drop = [&](const std::vector<Item>& gone) {
            if (!gone.empty() && !list.empty())
                std::erase_if(list, [&](const Item& item) { return std::ranges::find(gone, item) != gone.end(); });
        };
        drop(deleted);
        drop(prepended);
        drop(appended);
        list.insert(list.begin(), prepended.begin(), prepended.end());
        list.insert(list.end(), appended.begin(), appended.end());
    }
};

/// Times of a weaker layer in those of a stronger one: time · scale + offset.
struct UsdTime {
    double offset = 0, scale = 1;
    [[nodiscard]] double of(double time) const { return time * scale + offset; }
    /// First `inner`, then this.
    [[nodiscard]] UsdTime after(const UsdTime& inner) const {
        return {.offset = of(inner.offset), .scale = scale * inner.scale};
    }
    bool operator==(const UsdTime&) const = default;
};

/// A reference or a payload. No asset: into the same layers; no path: the layer's default prim.
struct UsdReference {
    std::string asset, path;
    UsdTime time;
    bool operator==(const UsdReference&) const = default;
};

using UsdMetadata = std::map<std::string, UsdValue, std::less<>>;

/// An attribute, or a relationship.
struct UsdProperty {
    std::string type;  ///< "float3[]"; of a relationship empty
    UsdValuePtr value;
    std::vector<std::pair<double, UsdValuePtr>> samples;  ///< ascending
    UsdListOp<std::string> targets;                       ///< of a relationship, or of a connection: absolute paths
    UsdMetadata metadata;
};

struct UsdPrim;
struct UsdVariantSet;

/// What few prims have.
struct UsdArcs {
    UsdListOp<UsdReference> references, payloads;
    UsdListOp<std::string> inherits, specializes;
    UsdListOp<std::string> variantSetNames;
    std::map<std::string, std::string> selections;  ///< by variant set
    std::vector<UsdVariantSet> variantSets;
};

/// Children in their order, found by name.
class UsdChildren {
public:
    /// The one of this name; a new one at the end where there is none.
    UsdPrim& at(std::string_view name);
    [[nodiscard]] const UsdPrim* find(std::string_view name) const;
    [[nodiscard]] const std::vector<std::unique_ptr<UsdPrim>>& list() const { return list_; }
    /// Those of these names first, in this order.
    void order(const std::vector<std::string>& names);

private:
    std::vector<std::unique_ptr<UsdPrim>> list_;
    std::unordered_map<std::string_view, UsdPrim*> byName_;  ///< of many
};

struct UsdPrim {
    enum class Specifier : std::uint8_t { kOver, kDef, kClass };
    std::string name, type;
    Specifier specifier = Specifier::kOver;
    UsdMetadata metadata;
    std::map<std::string, UsdProperty, std::less<>> properties;
    UsdChildren children;
    std::unique_ptr<UsdArcs> arcs;  ///< null: none

    [[nodiscard]] UsdArcs& needArcs() {
        if (!arcs) arcs = std::make_unique<UsdArcs>();
        return *arcs;
    }
    [[nodiscard]] const UsdProperty* property(std::string_view called) const {
        const auto found = properties.find(called);
        return found == properties.end() ? nullptr : &found->second;
    }
};

struct UsdVariantSet {
    std::string name;
    UsdChildren variants;  ///< each as a prim of the variant's name
};

struct UsdSublayer {
    std::string asset;
    UsdTime time;
};

struct UsdLayer {
    std::string identifier;              ///< by which it is opened once; what it names is relative to that
    UsdPrim root;                        ///< its metadata are the layer's
    std::vector<UsdSublayer> sublayers;  ///< the strongest first

    [[nodiscard]] double timeCodesPerSecond() const;
    /// The path of the default prim; empty: it names none.
    [[nodiscard]] std::string defaultPrim() const;
};

/// What a layer may be made of, so that no file takes more than its share.
struct UsdLayerLimits {
    std::size_t maxDepth = 255;        ///< of prims within prims
    std::size_t maxSpecs = 4'000'000;  ///< prims and properties
};

}  // namespace tessera
