#include <algorithm>
#include <unordered_set>

#include "server/import/reader/usd/UsdStage.h"

namespace tessera {

bool UsdComposedPrim::metadataTruth(std::string_view key, bool otherwise) const {
    const UsdValue* value = metadata(key);
    return value == nullptr ? otherwise : value->truth(otherwise);
}

const UsdValue* UsdComposedPrim::metadata(std::string_view key) const {
    for (const UsdOpinion& opinion : opinions_)
        if (const auto found = opinion.prim->metadata.find(key); found != opinion.prim->metadata.end())
            return &found->second;
    return nullptr;
}

const UsdValue* UsdComposedPrim::metadata(std::string_view property, std::string_view key) const {
    for (const UsdOpinion& opinion : opinions_)
        if (const UsdProperty* said = opinion.prim->property(property))
            if (const auto found = said->metadata.find(key); found != said->metadata.end()) return &found->second;
    return nullptr;
}

std::vector<std::string> UsdComposedPrim::childNames() const {
    std::vector<std::string> names;
    std::unordered_set<std::string_view> known;
    const bool isOne = opinions_.size() == 1;  // which has each name once
    // As USD has it: the weakest opinion's order, what stronger ones add behind it.
    for (auto opinion = opinions_.rbegin(); opinion != opinions_.rend(); ++opinion) {
        for (const std::unique_ptr<UsdPrim>& child : opinion->prim->children.list())
            if (isOne || known.insert(child->name).second) names.push_back(child->name);
        if (const auto order = opinion->prim->metadata.find("primOrder"); order != opinion->prim->metadata.end())
            if (order->second.words() != nullptr) orderUsdList(names, *order->second.words());
    }
    return names;
}

std::map<std::string, std::set<std::string>> UsdComposedPrim::variantSets() const {
    std::map<std::string, std::set<std::string>> sets;
    for (const UsdOpinion& opinion : opinions_)
        if (opinion.prim->arcs)
            for (const UsdVariantSet& set : opinion.prim->arcs->variantSets)
                for (const std::unique_ptr<UsdPrim>& variant : set.variants.list())
                    sets[set.name].insert(variant->name);
    return sets;
}

std::optional<UsdAttribute> UsdComposedPrim::attribute(std::string_view name) const {
    std::optional<UsdAttribute> out;
    for (const UsdOpinion& opinion : opinions_) {
        const UsdProperty* said = opinion.prim->property(name);
        if (said == nullptr) continue;
        if (!out) out.emplace();
        if (out->type.empty()) out->type = said->type;
        if (said->samples.empty() && !said->value) continue;
        out->layer = opinion.layer;
        for (const auto& [time, value] : said->samples)
            if (!value->blocked()) out->samples.emplace_back(opinion.time.of(time), value);
        if (opinion.time.scale < 0) std::ranges::reverse(out->samples);
        if (!out->samples.empty())
            out->value = out->samples.front().second;
        else if (said->value && !said->value->blocked())
            out->value = said->value;
        return out;
    }
    return out;
}

std::string UsdComposedPrim::stagePath(std::string path, std::size_t site) const {
    for (; sites_[site].arc != Arc::kRoot; site = sites_[site].parent) {
        const auto& [from, to] = std::pair(sites_[site].from, sites_[site].to);
        if (from == to) continue;
        if (path.starts_with(from) &&
            (path.size() == from.size() || path[from.size()] == '/' || path[from.size()] == '.'))
            path = to + path.substr(from.size());
    }
    return path;
}

std::vector<std::string> UsdComposedPrim::targets(std::string_view property) const {
    std::vector<std::string> targets;
    for (auto opinion = opinions_.rbegin(); opinion != opinions_.rend(); ++opinion) {
        const UsdProperty* said = opinion->prim->property(property);
        if (said == nullptr || said->targets.empty()) continue;
        UsdListOp<std::string> mapped = said->targets;
        for (auto* list :
             {&mapped.items, &mapped.added, &mapped.prepended, &mapped.appended, &mapped.deleted, &mapped.ordered})
            for (std::string& path : *list) path = stagePath(path, opinion->site);
        mapped.applyTo(targets);
    }
    return targets;
}

std::set<std::string> UsdComposedPrim::propertyNames() const {
    std::set<std::string> names;
    for (const UsdOpinion& opinion : opinions_)
        for (const auto& [name, property] : opinion.prim->properties) names.insert(name);
    return names;
}

}  // namespace tessera
