#include "server/import/reader/usd/UsdStage.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

namespace tessera {
namespace {

constexpr std::size_t kDeepestArcs = 100;
/// What a small file may come to.
constexpr std::size_t kMostFreeSites = 1'000'000;
constexpr std::size_t kMostOpinionsPerPrim = 100'000;
/// What a circle that is found costs beside a site: small files can have very many.
constexpr std::size_t kSitesPerCircle = 8;
/// Properties of a prim that cost nothing beside it; each more is a site's work.
constexpr std::size_t kFreeProperties = 64;

/// Whether one of the paths is the other or below it.
bool isRelated(std::string_view a, std::string_view b) {
    if (a.size() > b.size()) std::swap(a, b);
    return b.starts_with(a) && (a.size() == b.size() || a == "/" || b[a.size()] == '/');
}

std::string joined(const std::string& parent, const std::string& name) {
    return parent == "/" ? "/" + name : parent + "/" + name;
}

/// Names of the sets of a site, the strongest first: those that `variantSets` names count alone.
std::vector<std::string> variantSetsOf(const std::vector<UsdOpinion>& specs) {
    std::vector<std::string> named;
    std::set<std::string_view> there;
    for (auto spec = specs.rbegin(); spec != specs.rend(); ++spec) {
        const UsdArcs* arcs = spec->prim->arcs.get();
        if (arcs == nullptr) continue;
        arcs->variantSetNames.applyTo(named);
        for (const UsdVariantSet& set : arcs->variantSets) there.insert(set.name);
    }
    std::erase_if(named, [&](const std::string& name) { return !there.contains(name); });
    return named;
}

/// Paths may choose variants, "/A{shape=round}B"; what is chosen is said elsewhere too.
std::string withoutSelections(const std::string& path) {
    std::string out;
    for (std::size_t i = 0; i < path.size(); ++i) {
        if (path[i] == '{')
            i = std::min(path.find('}', i), path.size() - 1);
        else
            out += path[i];
    }
    return out;
}

}  // namespace

Expected<void> UsdStage::count(std::size_t sites) {
    sites_ += sites;
    // Files of many bytes may well come to more.
    const std::size_t most = kMostFreeSites + files_.bytesRead() / 8;
    if (sites_ <= most) return {};
    if (circles_ > kMostFreeSites / 100)
        return fail(ErrorCode::kLimit,
                    fmt::format("its references, payloads and inherits go in circles in more than {} ways; one is {}",
                                circles_ - 1, circle_));
    return fail(
        ErrorCode::kLimit,
        fmt::format("its layers come to more than {} prims, those that are placed often counted each time", most));
}

void UsdStage::remarkOf(const UsdLayer& layer) {
    for (const auto& [what, object] : layer.remarks) remarks_.add(what, object);
}

void UsdStage::addSublayers(UsdLayerStack& stack, const std::shared_ptr<const UsdLayer>& layer, const UsdTime& time,
                            std::vector<std::string>& open) {
    stack.layers.emplace_back(layer, time);
    remarkOf(*layer);
    open.push_back(layer->identifier);
    for (const UsdSublayer& named : layer->sublayers) {
        const auto sublayer = files_.layer(named.asset, layer->identifier);
        if (!sublayer) {
            remarks_.add("sublayers are left out",
                         fmt::format("{} (of {})", sublayer.error().message, layer->identifier));
            continue;
        }
        if (std::ranges::find(open, (*sublayer)->identifier) != open.end()) {
            remarks_.add("sublayers that go in a circle are left out",
                         fmt::format("'{}' of {}", named.asset, layer->identifier));
            continue;
        }
        const bool known = std::ranges::any_of(
            stack.layers, [&](const auto& held) { return held.first->identifier == (*sublayer)->identifier; });
        if (known) continue;  // it says nothing new
        if (open.size() > kDeepestArcs) {
            remarks_.add(fmt::format("sublayers nested deeper than {} levels are left out", kDeepestArcs),
                         fmt::format("'{}' of {}", named.asset, layer->identifier));
            continue;
        }
        UsdTime inner = named.time;
        inner.scale *= layer->timeCodesPerSecond() / (*sublayer)->timeCodesPerSecond();
        addSublayers(stack, *sublayer, time.after(inner), open);
    }
    open.pop_back();
}

Expected<const UsdLayerStack*> UsdStage::stackOf(const std::shared_ptr<const UsdLayer>& layer) {
    std::unique_ptr<UsdLayerStack>& stack = stacks_[layer->identifier];
    if (!stack) {
        auto made = std::make_unique<UsdLayerStack>();
        made->root = layer;
        std::vector<std::string> open;
        addSublayers(*made, layer, {}, open);
        stack = std::move(made);
    }
    return stack.get();
}

Expected<void> UsdStage::open(const std::string& name) {
    const auto layer = files_.layer(name, "");
    if (!layer) return tl::unexpected(layer.error());
    const Expected<const UsdLayerStack*> stack = stackOf(*layer);
    if (!stack) return tl::unexpected(stack.error());
    root_ = *stack;
    return {};
}

Expected<void> UsdStage::choose(const std::vector<UsdChoice>& choices) {
    for (const UsdChoice& choice : choices) chosen_[{choice.prim, choice.set}] = choice.variant;
    for (const UsdChoice& choice : choices)
        if (Expected<void> done = checkChoice(choice); !done) return done;
    return {};
}

Expected<void> UsdStage::checkChoice(const UsdChoice& choice) {
    const std::string said = fmt::format("--variant {}:{}={}", choice.prim, choice.set, choice.variant);
    const auto thereAre = [](const auto& names) {
        constexpr std::size_t kMostNames = 20;
        std::vector<std::string> first;
        for (const std::string& name : names)
            if (first.size() < kMostNames) first.push_back("'" + name + "'");
        if (first.empty()) return std::string("there is none");
        return fmt::format(
            "there are {}{}", fmt::join(first, ", "),
            names.size() > first.size() ? fmt::format(" and {} others", names.size() - first.size()) : "");
    };
    // As far down as there are prims.
    Expected<Prim> found = root();
    for (std::size_t end = 0; found && end < choice.prim.size();) {
        end = std::min(choice.prim.find('/', end + 1), choice.prim.size());
        const Expected<Prim> next = at(choice.prim.substr(0, end));
        if (!next) return tl::unexpected(next.error());
        if (!*next)
            return fail(ErrorCode::kNotFound,
                        fmt::format("{}: there is no prim {}; below {} {}", said, choice.prim.substr(0, end),
                                    (*found)->path(), thereAre((*found)->childNames())));
        found = next;
    }
    if (!found) return tl::unexpected(found.error());
    const std::map<std::string, std::set<std::string>> sets = (*found)->variantSets();
    std::vector<std::string> names;
    for (const auto& [name, variants] : sets) names.push_back(name);
    const auto set = sets.find(choice.set);
    if (set == sets.end())
        return fail(ErrorCode::kNotFound, fmt::format("{}: {} has no set of variants '{}'; {}", said, choice.prim,
                                                      choice.set, thereAre(names)));
    if (!set->second.contains(choice.variant))
        return fail(ErrorCode::kNotFound, fmt::format("{}: the set '{}' of {} has no variant '{}'; {}", said,
                                                      choice.set, choice.prim, choice.variant, thereAre(set->second)));
    return {};
}

const UsdValue* UsdStage::metadata(std::string_view key) const {
    for (const auto& [layer, time] : root_->layers)
        if (const auto found = layer->root.metadata.find(key); found != layer->root.metadata.end())
            return &found->second;
    return nullptr;
}

// ---- sites ----------------------------------------------------------------------------------------------------------

std::vector<std::size_t> UsdStage::byStrength(const Index& index) {
    std::vector<std::vector<std::size_t>> below(index.size());
    for (std::size_t i = 1; i < index.size(); ++i) below[index[i].parent].push_back(i);
    for (std::vector<std::size_t>& sites : below)
        std::ranges::stable_sort(sites, [&](std::size_t a, std::size_t b) {
            // What is said above of what something below specializes is before that.
            const auto isAbove = [&](std::size_t i) { return index[i].implied && index[i].arc == Arc::kSpecialize; };
            if (isAbove(a) != isAbove(b)) return isAbove(a);
            if (index[a].arc != index[b].arc) return index[a].arc < index[b].arc;
            return index[a].depth > index[b].depth;
        });
    // What is specialized is weaker than all else, wherever it is named.
    std::vector<std::size_t> order, weak, open = {0};
    std::vector<bool> isWeak(index.size());
    while (!open.empty()) {
        const std::size_t site = open.back();
        open.pop_back();
        isWeak[site] = index[site].arc == Arc::kSpecialize || (site > 0 && isWeak[index[site].parent]);
        (isWeak[site] ? weak : order).push_back(site);
        open.insert(open.end(), below[site].rbegin(), below[site].rend());
    }
    order.insert(order.end(), weak.begin(), weak.end());
    return order;
}

bool UsdStage::goesInCircle(const Index& index, std::size_t site, const UsdLayerStack& stack,
                            const std::string& path) const {
    for (const auto& [following, at] : following_)
        if (following == &stack && isRelated(at, path)) return true;
    for (;; site = index[site].parent) {
        if (index[site].stack == &stack && isRelated(index[site].path, path)) return true;
        if (index[site].arc == Arc::kRoot) return false;
    }
}

Expected<void> UsdStage::graft(Index& index, std::size_t site, const UsdLayerStack& stack, const std::string& path,
                               Arc arc, const UsdTime& outer, std::size_t depth, bool implied) {
    if (goesInCircle(index, site, stack, path)) {
        std::string circle =
            fmt::format("<{}> of <{}> in {}", path, index[site].path, index[site].stack->root->identifier);
        remarks_.add("references, payloads and inherits that go in a circle are left out", circle);
        if (circles_++ == 0) circle_ = std::move(circle);
        return count(kSitesPerCircle);
    }
    if (following_.size() >= kDeepestArcs)
        return fail(ErrorCode::kLimit,
                    fmt::format("references are nested deeper than {} levels at <{}>", kDeepestArcs, index[site].path));
    following_.emplace_back(index[site].stack, index[site].path);
    Expected<Index> sub = indexOf(stack, path);
    following_.pop_back();
    if (!sub) return tl::unexpected(sub.error());
    if (std::ranges::all_of(*sub, [](const Site& made) { return made.specs.empty(); })) {
        if (arc == Arc::kReference || arc == Arc::kPayload)
            remarks_.add("references to prims that are not there are left out",
                         fmt::format("<{}> of <{}> in {}", path, index[site].path, stack.root->identifier));
        return {};
    }
    // Each is moved once for each arc that leads to it.
    if (Expected<void> counted = count(following_.empty() ? 0 : sub->size()); !counted) return counted;
    const std::size_t first = index.size();
    for (Site& made : *sub) {
        made.time = outer.after(made.time);
        for (UsdOpinion& spec : made.specs) spec.time = outer.after(spec.time);
        made.parent += first;
        index.push_back(std::move(made));
    }
    Site& top = index[first];
    top.parent = site;
    top.arc = arc;
    top.depth = depth;
    top.from = path;
    top.to = index[site].path;
    top.implied = implied;
    if (implied) return {};  // further above it has been looked for
    const std::size_t end = index.size();
    for (std::size_t i = first; i < end; ++i)
        if (index[i].arc == Arc::kInherit || index[i].arc == Arc::kSpecialize)
            if (Expected<void> done = addImplied(index, i, i == first ? site : first, depth); !done) return done;
    return {};
}

Expected<void> UsdStage::addImplied(Index& index, std::size_t named, std::size_t above, std::size_t depth) {
    const Arc arc = index[named].arc;
    std::string path = index[named].path;
    bool reached = index[named].parent == above;
    for (std::size_t heir = index[named].parent; index[heir].arc != Arc::kRoot; heir = index[heir].parent) {
        reached = reached || heir == above;
        if (index[heir].arc == Arc::kVariant) continue;
        // Of the referenced prim's own tree it is called otherwise there; of the whole file the same.
        if (path.starts_with(index[heir].from + "/")) path = index[heir].to + path.substr(index[heir].from.size());
        // Those below have been looked through when they were composed.
        if (!reached || (index[heir].arc != Arc::kReference && index[heir].arc != Arc::kPayload)) continue;
        // What is specialized is as weak as where that is said.
        const std::size_t site = index[heir].parent, under = arc == Arc::kSpecialize ? heir : site;
        const UsdLayerStack& stack = *index[site].stack;
        const bool known = std::ranges::any_of(
            index, [&](const Site& held) { return held.stack == &stack && held.arc == arc && held.path == path; });
        if (known || goesInCircle(index, site, stack, path)) continue;
        if (Expected<void> done = graft(index, under, stack, path, arc, index[site].time, depth, true); !done)
            return done;
    }
    return {};
}

void UsdStage::remarkOfUnits(const UsdLayer& layer) {
    const auto unitOf = [](const UsdLayer& of) {
        const auto said = of.root.metadata.find("metersPerUnit");
        return said == of.root.metadata.end() ? std::nullopt : said->second.number();
    };
    const auto upOf = [](const UsdLayer& of) {
        const auto said = of.root.metadata.find("upAxis");
        return said == of.root.metadata.end() || said->second.word() == nullptr ? std::string() : *said->second.word();
    };
    const std::optional<double> mine = unitOf(*root_->root), its = unitOf(layer);
    if (its && std::abs(*its - mine.value_or(0.01)) > 1e-6 * std::abs(*its))
        remarks_.add("files that are referred to have another unit, which USD does not convert",
                     fmt::format("{} of {} metres", layer.identifier, *its));
    const std::string up = upOf(layer);
    if (!up.empty() && up != (upOf(*root_->root).empty() ? "Y" : upOf(*root_->root)))
        remarks_.add("files that are referred to have another axis up, which USD does not convert",
                     fmt::format("{} of {}", layer.identifier, up));
}

Expected<void> UsdStage::addReference(Index& index, std::size_t site, const UsdReference& reference,
                                      const UsdOpinion& by, Arc arc, std::size_t depth) {
    const UsdLayerStack* stack = index[site].stack;
    // What it means is told from the layer that names it, which may be a sublayer with times of its own.
    UsdTime time = reference.time;
    if (!reference.asset.empty()) {
        const auto layer = files_.layer(reference.asset, by.layer->identifier);
        if (!layer) {
            remarks_.add("references to files are left out",
                         fmt::format("{} (of <{}>)", layer.error().message, index[site].path));
            return {};
        }
        const Expected<const UsdLayerStack*> opened = stackOf(*layer);
        if (!opened) return tl::unexpected(opened.error());
        stack = *opened;
        time.scale *= by.layer->timeCodesPerSecond() / (*layer)->timeCodesPerSecond();
        remarkOfUnits(**layer);
    }
    std::string path = withoutSelections(reference.path.empty() ? stack->root->defaultPrim() : reference.path);
    if (path.empty() || path == "/") {
        // Files without a default prim are common: the first of those at the top is what is meant.
        for (const std::unique_ptr<UsdPrim>& prim : stack->root->root.children.list())
            if (path.size() <= 1 && prim->specifier == UsdPrim::Specifier::kDef) path = "/" + prim->name;
        if (path.size() <= 1) return {};
        remarks_.add("files that are referred to name no default prim; the first is taken",
                     fmt::format("{} of {}", path, stack->root->identifier));
    }
    return graft(index, site, *stack, path, arc, by.time.after(time), depth);
}

Expected<void> UsdStage::followArcsOf(Index& index, std::size_t site, std::size_t depth) {
    index[site].followed = true;
    std::vector<std::string> inherits, specializes;
    // Each with the opinion that names it: files are relative to that one's. They are the same where they mean the
    // same.
    struct Named {
        UsdReference reference;
        std::string file;
        std::size_t by = 0;
        bool operator<(const Named& other) const {
            return std::tie(file, reference.path, reference.time) <
                   std::tie(other.file, other.reference.path, other.reference.time);
        }
    };
    std::vector<Named> references, payloads;
    const std::vector<UsdOpinion> specs = index[site].specs;
    for (std::size_t i = specs.size(); i-- > 0;) {
        const UsdArcs* arcs = specs[i].prim->arcs.get();
        if (specs[i].prim->metadata.contains("relocates")) remarks_.add("relocates are left out", index[site].path);
        if (arcs == nullptr) continue;
        arcs->inherits.applyTo(inherits);
        arcs->specializes.applyTo(specializes);
        const auto apply = [&](const UsdListOp<UsdReference>& list, auto& to) {
            UsdListOp<Named> by;
            by.isExplicit = list.isExplicit;
            for (const auto& [from, into] :
                 {std::pair(&list.items, &by.items), std::pair(&list.added, &by.added),
                  std::pair(&list.prepended, &by.prepended), std::pair(&list.appended, &by.appended),
                  std::pair(&list.deleted, &by.deleted), std::pair(&list.ordered, &by.ordered)})
                for (const UsdReference& reference : *from) {
                    std::string file = reference.asset;
                    if (!file.empty()) file = UsdFiles::identifierOf(file, specs[i].layer->identifier);
                    into->push_back({reference, file.empty() ? reference.asset : std::move(file), i});
                }
            by.applyTo(to);
        };
        apply(arcs->references, references);
        apply(arcs->payloads, payloads);
    }
    for (const auto& [list, arc] : {std::pair(&inherits, Arc::kInherit), std::pair(&specializes, Arc::kSpecialize)})
        for (const std::string& path : *list) {
            const UsdLayerStack& stack = *index[site].stack;
            if (Expected<void> done = graft(index, site, stack, withoutSelections(path), arc, index[site].time, depth);
                !done)
                return done;
        }
    for (const auto& [list, arc] : {std::pair(&references, Arc::kReference), std::pair(&payloads, Arc::kPayload)})
        for (const Named& named : *list)
            if (Expected<void> done = addReference(index, site, named.reference, specs[named.by], arc, depth); !done)
                return done;
    return {};
}

Expected<void> UsdStage::followArcs(Index& index, std::size_t depth) {
    for (std::size_t site = 0; site < index.size(); ++site)
        if (!index[site].followed)
            if (Expected<void> done = followArcsOf(index, site, depth); !done) return done;
    return {};
}

Expected<void> UsdStage::chooseVariants(Index& index, std::size_t depth, const std::string& stagePath) {
    // A variant may bring further sets, and what chooses among them.
    for (bool found = true; found;) {
        found = false;
        const std::vector<std::size_t> order = byStrength(index);
        const auto chosen = [&](const std::string& set) -> std::string {
            for (const std::size_t site : order)
                for (const UsdOpinion& spec : index[site].specs)
                    if (spec.prim->arcs)
                        if (const auto said = spec.prim->arcs->selections.find(set);
                            said != spec.prim->arcs->selections.end())
                            return said->second;
            return {};
        };
        for (const std::size_t site : order) {
            if (index[site].chosen) continue;
            index[site].chosen = true;
            for (const std::string& set : variantSetsOf(index[site].specs)) {
                const auto wished = chosen_.find({stagePath, set});
                const std::string name = wished != chosen_.end() ? wished->second : chosen(set);
                Site made{.stack = index[site].stack,
                          .path = index[site].path,
                          .specs = {},
                          .parent = site,
                          .arc = Arc::kVariant,
                          .depth = depth,
                          .from = {},
                          .to = {},
                          .time = index[site].time};
                for (const UsdOpinion& spec : index[site].specs) {
                    if (!spec.prim->arcs) continue;
                    for (const UsdVariantSet& held : spec.prim->arcs->variantSets)
                        if (held.name == set)
                            if (const UsdPrim* variant = held.variants.find(name)) {
                                made.specs.push_back(spec);
                                made.specs.back().prim = variant;
                            }
                }
                if (made.specs.empty()) {
                    if (!stagePath.empty())
                        remarks_.add(name.empty() ? "sets of variants of which none is chosen show none"
                                                  : "variants that are chosen and not there show none",
                                     name.empty() ? fmt::format("{} of {}", set, stagePath)
                                                  : fmt::format("{} = {} of {}", set, name, stagePath));
                    continue;
                }
                if (Expected<void> counted = count(made.specs.size()); !counted) return counted;
                index.push_back(std::move(made));
                found = true;
            }
        }
        if (found)
            if (Expected<void> done = followArcs(index, depth); !done) return done;
    }
    return {};
}

// ---- prims ----------------------------------------------------------------------------------------------------------

Expected<UsdStage::Index> UsdStage::childIndex(const Index& parent, const std::string& name, std::size_t depth,
                                               bool ofInstance) {
    Index index;
    // Whether a site came by an arc of the parent itself.
    std::vector<bool> brought(parent.size());
    for (std::size_t i = 1; i < parent.size(); ++i)
        brought[i] = parent[i].depth + 1 == depth || brought[parent[i].parent];
    ofInstance = ofInstance && std::ranges::find(brought, true) != brought.end();
    std::vector<std::size_t> renumbered(parent.size(), parent.size());
    std::vector<bool> needed(parent.size());
    std::vector<std::vector<UsdOpinion>> specs(parent.size());
    for (std::size_t i = parent.size(); i-- > 0;) {
        for (const UsdOpinion& spec : parent[i].specs)
            if (ofInstance && !brought[i])
                break;
            else if (const UsdPrim* child = spec.prim->children.find(name)) {
                specs[i].push_back(spec);
                specs[i].back().prim = child;
            }
        needed[i] = needed[i] || !specs[i].empty() || i == 0;
        if (needed[i]) needed[parent[i].parent] = true;  // parents come first
    }
    std::size_t opinions = 0;
    for (std::size_t i = 0; i < parent.size(); ++i) {
        if (!needed[i]) continue;
        renumbered[i] = index.size();
        Site site = parent[i];
        site.path = joined(site.path, name);
        site.specs = std::move(specs[i]);
        site.parent = renumbered[parent[i].parent];
        site.followed = site.chosen = site.specs.empty();
        opinions += site.specs.size() + 1;
        index.push_back(std::move(site));
    }
    if (Expected<void> counted = count(opinions); !counted) return tl::unexpected(counted.error());
    if (Expected<void> done = followArcs(index, depth); !done) return tl::unexpected(done.error());
    return index;
}

/// Variants of the prim itself are left to whoever refers to it: it may choose.
Expected<UsdStage::Index> UsdStage::indexOf(const UsdLayerStack& stack, const std::string& path) {
    if (path == "/" || path.empty()) {
        Site site{.stack = &stack, .path = "/", .specs = {}, .from = {}, .to = {}, .time = {}};
        for (const auto& [layer, time] : stack.layers)
            site.specs.push_back({.prim = &layer->root, .layer = layer.get(), .time = time, .site = 0});
        if (Expected<void> counted = count(site.specs.size()); !counted) return tl::unexpected(counted.error());
        site.followed = site.chosen = true;
        return Index{std::move(site)};
    }
    const auto depth = static_cast<std::size_t>(std::ranges::count(path, '/'));
    if (depth > kDeepestArcs * 3) return fail(ErrorCode::kLimit, fmt::format("the path <{}> is too deep", path));
    const std::size_t slash = path.rfind('/');
    Expected<Index> parent = indexOf(stack, slash == 0 ? "/" : path.substr(0, slash));
    if (!parent) return parent;
    if (Expected<void> done = chooseVariants(*parent, depth - 1, ""); !done) return tl::unexpected(done.error());
    return childIndex(*parent, path.substr(slash + 1), depth, false);
}

bool UsdStage::isOfClass(const Index& index, std::size_t site) {
    for (; index[site].arc != Arc::kRoot; site = index[site].parent)
        if (index[site].arc == Arc::kInherit || index[site].arc == Arc::kSpecialize) return true;
    return false;
}

Expected<UsdStage::Prim> UsdStage::finish(Index index, std::string path) {
    auto prim = std::make_shared<UsdComposedPrim>();
    prim->path_ = std::move(path);
    const auto depth = static_cast<std::size_t>(std::ranges::count(prim->path_, '/'));
    if (Expected<void> done = chooseVariants(index, depth, prim->path_); !done) return tl::unexpected(done.error());
    for (const std::size_t site : byStrength(index))
        for (UsdOpinion spec : index[site].specs) {
            spec.site = site;
            prim->opinions_.push_back(spec);
        }
    if (prim->opinions_.size() > kMostOpinionsPerPrim)
        return fail(ErrorCode::kLimit,
                    fmt::format("<{}> has more than {} opinions", prim->path_, kMostOpinionsPerPrim));
    // A class that it inherits makes it none: what defines it otherwise does.
    using Specifier = UsdPrim::Specifier;
    bool defined = false;
    std::size_t properties = 0;
    for (const UsdOpinion& opinion : prim->opinions_) {
        properties += opinion.prim->properties.size();
        if (prim->type_.empty()) prim->type_ = opinion.prim->type;
        if (defined || opinion.prim->specifier == Specifier::kOver) continue;
        prim->specifier_ = opinion.prim->specifier;
        defined = prim->specifier_ == Specifier::kDef || !isOfClass(index, opinion.site);
    }
    if (properties > kFreeProperties)
        if (Expected<void> counted = count(properties - kFreeProperties); !counted)
            return tl::unexpected(counted.error());
    prim->sites_ = std::move(index);
    return Prim(std::move(prim));
}

Expected<UsdStage::Prim> UsdStage::root() {
    return at("/");
}

Expected<UsdStage::Prim> UsdStage::child(const UsdComposedPrim& parent, const std::string& name) {
    std::string path = joined(parent.path(), name);
    if (const auto known = known_.find(path); known != known_.end()) return known->second;
    Expected<Index> index =
        childIndex(parent.sites_, name, static_cast<std::size_t>(std::ranges::count(path, '/')), parent.instanceable());
    if (!index) return tl::unexpected(index.error());
    return finish(std::move(*index), std::move(path));
}

Expected<UsdStage::Prim> UsdStage::at(const std::string& path) {
    if (const auto known = known_.find(path); known != known_.end()) return known->second;
    Prim made;
    if (path == "/" || path.empty()) {
        Expected<Index> index = indexOf(*root_, "/");
        if (!index) return tl::unexpected(index.error());
        Expected<Prim> root = finish(std::move(*index), "/");
        if (!root) return root;
        made = std::move(*root);
    } else {
        if (path.front() != '/' || static_cast<std::size_t>(std::ranges::count(path, '/')) > kDeepestArcs * 3)
            return Prim();
        const std::size_t slash = path.rfind('/');
        const Expected<Prim> parent = at(slash == 0 ? "/" : path.substr(0, slash));
        if (!parent || !*parent) return parent;
        Expected<Prim> found = child(**parent, path.substr(slash + 1));
        if (!found) return found;
        if (!(*found)->opinions().empty()) made = std::move(*found);
    }
    known_.emplace(path, made);
    return made;
}

}  // namespace tessera
