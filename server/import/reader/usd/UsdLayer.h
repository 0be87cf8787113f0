/// One USD file in memory, text or crate: what it says, before anything of it is composed with others.
#pragma once

#include <algorithm>
#include <compare>
#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "server/import/reader/usd/UsdValue.h"

namespace tessera {

/// Those that `order` names in its order, each followed by what came behind it and is not named.
template <typename Item>
void orderUsdList(std::vector<Item>& list, const std::vector<Item>& order) {
    std::map<Item, std::size_t> ranks;
    for (const Item& item : order) ranks.emplace(item, ranks.size() + 1);
    std::vector<std::pair<std::size_t, Item>> ranked;
    std::size_t rank = 0;  // before all: what comes before the first that is named
    for (Item& item : list) {
        if (const auto named = ranks.find(item); named != ranks.end()) rank = named->second;
        ranked.emplace_back(rank, std::move(item));
    }
    std::ranges::stable_sort(ranked, {}, [](const auto& entry) { return entry.first; });
    std::ranges::transform(ranked, list.begin(), [](auto& entry) { return std::move(entry.second); });
}

/// Changes of a weaker list, or, explicit, a list of its own.
template <typename Item>
struct UsdListOp {
    bool isExplicit = false;
    std::vector<Item> items;  ///< of an explicit one
    std::vector<Item> added;  ///< behind the others, where they are not among them
    std::vector<Item> prepended, appended, deleted;
    std::vector<Item> ordered;  ///< brought into this order, those that are there

    [[nodiscard]] bool empty() const {
        return !isExplicit && added.empty() && prepended.empty() && appended.empty() && deleted.empty() &&
               ordered.empty();
    }
    /// `list`: what weaker opinions say; becomes what they and this one say together, each once.
    void applyTo(std::vector<Item>& list) const {
        if (isExplicit) {
            list = items;
            return keepFirst(list);
        }
        const auto drop = [&](const std::vector<Item>& gone) {
            if (gone.empty() || list.empty()) return;
            const std::set<Item> those(gone.begin(), gone.end());
            std::erase_if(list, [&](const Item& item) { return those.contains(item); });
        };
        drop(deleted);
        list.insert(list.end(), added.begin(), added.end());
        keepFirst(list);
        drop(prepended);
        list.insert(list.begin(), prepended.begin(), prepended.end());
        drop(appended);
        list.insert(list.end(), appended.begin(), appended.end());
        keepFirst(list);
        if (!ordered.empty()) orderUsdList(list, ordered);
    }

private:
    static void keepFirst(std::vector<Item>& list) {
        std::set<Item> seen;
        if (list.size() > 1) std::erase_if(list, [&](const Item& item) { return !seen.insert(item).second; });
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
    auto operator<=>(const UsdTime&) const = default;
};

/// A reference or a payload. No asset: into the same layers; no path: the layer's default prim.
struct UsdReference {
    std::string asset, path;
    UsdTime time;
    auto operator<=>(const UsdReference&) const = default;
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
    std::unique_ptr<std::unordered_map<std::string_view, UsdPrim*>> byName_;  ///< of many; most prims have few
    mutable std::size_t next_ = 0;  ///< who goes from one to the next finds each at once
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
    /// What is odd in it, and was read all the same: a kind of thing, and where.
    std::vector<std::pair<std::string, std::string>> remarks;

    [[nodiscard]] double timeCodesPerSecond() const;
    /// The path of the default prim; empty: it names none.
    [[nodiscard]] std::string defaultPrim() const;
};

/// What a layer may be made of, so that no file takes more than its share.
struct UsdLayerLimits {
    std::size_t maxDepth = 255;        ///< of prims within prims
    std::size_t maxSpecs = 4'000'000;  ///< prims and properties
    /// Each takes some 300 bytes of memory, and in a file `bytesEach` mostly: small files have few.
    [[nodiscard]] std::size_t specsOf(std::size_t fileBytes, std::size_t bytesEach) const {
        return std::min(maxSpecs, 300'000 + fileBytes / bytesEach);
    }
};

}  // namespace tessera
