#include "server/import/reader/usd/UsdLayer.h"

#include <algorithm>

namespace tessera {
namespace {

/// Fewer are found faster one by one.
constexpr std::size_t kFewChildren = 8;

}  // namespace

UsdPrim& UsdChildren::at(std::string_view name) {
    if (!byName_)
        if (const UsdPrim* known = find(name)) return const_cast<UsdPrim&>(*known);
    auto made = std::make_unique<UsdPrim>();
    made->name = name;
    if (list_.size() == kFewChildren) {
        byName_ = std::make_unique<std::unordered_map<std::string_view, UsdPrim*>>();
        for (const std::unique_ptr<UsdPrim>& child : list_) byName_->emplace(child->name, child.get());
    }
    if (byName_)
        if (const auto [there, isNew] = byName_->try_emplace(made->name, made.get()); !isNew) return *there->second;
    return *list_.emplace_back(std::move(made));
}

const UsdPrim* UsdChildren::find(std::string_view name) const {
    if (next_ < list_.size() && list_[next_]->name == name) return list_[next_++].get();
    if (byName_) {
        const auto found = byName_->find(name);
        return found == byName_->end() ? nullptr : found->second;
    }
    for (std::size_t i = 0; i < list_.size(); ++i) {
        if (list_[i]->name != name) continue;
        next_ = i + 1;
        return list_[i].get();
    }
    return nullptr;
}

void UsdChildren::order(const std::vector<std::string>& names) {
    std::unordered_map<std::string_view, std::size_t> rank;
    for (const std::string& name : names) rank.emplace(name, rank.size());
    const auto rankOf = [&](const std::unique_ptr<UsdPrim>& prim) {
        const auto found = rank.find(prim->name);
        return found == rank.end() ? rank.size() : found->second;
    };
    std::ranges::stable_sort(list_, {}, rankOf);
}

double UsdLayer::timeCodesPerSecond() const {
    // As USD has it: 24, where neither is said.
    for (const char* name : {"timeCodesPerSecond", "framesPerSecond"})
        if (const auto found = root.metadata.find(name); found != root.metadata.end())
            if (const double rate = found->second.number().value_or(0); rate > 1e-6 && rate < 1e9) return rate;
    return 24;
}

std::string UsdLayer::defaultPrim() const {
    const auto found = root.metadata.find("defaultPrim");
    const std::string* name = found == root.metadata.end() ? nullptr : found->second.word();
    if (name == nullptr || name->empty()) return {};
    return name->front() == '/' ? *name : "/" + *name;
}

}  // namespace tessera
