/// Layers composed to one scene: who overrides whom, as USD's glossary has it under "LIVRPS".
///
/// Each prim is composed when somebody asks, from its parent: nothing holds the whole stage, and what several prims
/// refer to is read once. Strength: local opinions of all sublayers, inherits, variants, references, payloads,
/// specializes, the deeper in the tree an arc stands the stronger. A class that a referenced prim inherits counts under
/// its name here, too, before what is referenced. Not as in USD's own: relocates are named and left out.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/base/Error.h"
#include "server/import/reader/usd/UsdFiles.h"
#include "server/import/reader/usd/UsdRemarks.h"

namespace tessera {

/// Layers that count as one: a file and its sublayers, the strongest first.
struct UsdLayerStack {
    std::shared_ptr<const UsdLayer> root;
    std::vector<std::pair<std::shared_ptr<const UsdLayer>, UsdTime>> layers;
};

/// What one layer says of a prim.
struct UsdOpinion {
    const UsdPrim* prim = nullptr;
    const UsdLayer* layer = nullptr;
    UsdTime time;          ///< to the stage's
    std::size_t site = 0;  ///< whose paths it speaks in
};

/// A property with what is strongest of it.
struct UsdAttribute {
    UsdValuePtr value;  ///< at the first sample, where there are some; null: none, or blocked
    std::vector<std::pair<double, UsdValuePtr>> samples;  ///< at times of the stage
    const UsdLayer* layer = nullptr;                      ///< to which asset paths are relative
    std::string type;
};

/// A variant that a person has chosen.
struct UsdChoice {
    std::string prim, set, variant;
};

/// A prim with all that is said of it. Lives as long as the stage.
class UsdComposedPrim {
public:
    [[nodiscard]] const std::string& path() const { return path_; }
    [[nodiscard]] std::string name() const { return path_.substr(path_.rfind('/') + 1); }
    [[nodiscard]] const std::string& type() const { return type_; }
    /// Of the strongest opinion that is more than `over`.
    [[nodiscard]] UsdPrim::Specifier specifier() const { return specifier_; }
    [[nodiscard]] bool active() const { return metadataTruth("active", true); }
    [[nodiscard]] bool instanceable() const { return metadataTruth("instanceable", false); }
    /// In their order.
    [[nodiscard]] std::vector<std::string> childNames() const;
    /// The names of each set's variants.
    [[nodiscard]] std::map<std::string, std::set<std::string>> variantSets() const;

    [[nodiscard]] std::optional<UsdAttribute> attribute(std::string_view name) const;
    /// Of the attribute's strongest opinion that has it; null: nobody does.
    [[nodiscard]] const UsdValue* metadata(std::string_view property, std::string_view key) const;
    /// Of the prim.
    [[nodiscard]] const UsdValue* metadata(std::string_view key) const;
    /// What a relationship or a connection names, as paths of the stage.
    [[nodiscard]] std::vector<std::string> targets(std::string_view property) const;
    /// Of all opinions.
    [[nodiscard]] std::set<std::string> propertyNames() const;
    [[nodiscard]] const std::vector<UsdOpinion>& opinions() const { return opinions_; }

private:
    friend class UsdStage;
    enum class Arc : std::uint8_t { kRoot, kInherit, kVariant, kReference, kPayload, kSpecialize };
    /// A place in some layers that says something of this prim.
    struct Site {
        const UsdLayerStack* stack = nullptr;
        std::string path;               ///< in these
        std::vector<UsdOpinion> specs;  ///< of each layer that has any
        std::size_t parent = 0;         ///< the site whose arc leads here; the root's own: 0
        Arc arc = Arc::kRoot;
        std::size_t depth = 0;  ///< at which the arc stands
        std::string from, to;   ///< of paths here, and what that is called in the parent's
        UsdTime time;
        bool followed = false, chosen = false;  ///< its arcs, its variants
        bool implied = false;                   ///< by what another stack says of the same prim
    };
    [[nodiscard]] bool metadataTruth(std::string_view key, bool otherwise) const;
    [[nodiscard]] std::string stagePath(std::string path, std::size_t site) const;

    std::string path_, type_;
    UsdPrim::Specifier specifier_ = UsdPrim::Specifier::kOver;
    std::vector<Site> sites_;
    std::vector<UsdOpinion> opinions_;  ///< the strongest first
};

class UsdStage {
public:
    UsdStage(UsdFiles& files, UsdRemarks& remarks) : files_(files), remarks_(remarks) {}

    /// The file's own layer, by its name. What it says of times, units and axes is in `rootLayer`.
    [[nodiscard]] Expected<void> open(const std::string& name);
    /// Variants of the stage's prims that count whatever the file says; before anything is asked for. kNotFound: there
    /// is no such prim, set or variant; the message says which there are.
    [[nodiscard]] Expected<void> choose(const std::vector<UsdChoice>& choices);
    [[nodiscard]] const UsdLayer& rootLayer() const { return *root_->root; }
    /// Metadata of the whole stage; of sublayers where the root says nothing.
    [[nodiscard]] const UsdValue* metadata(std::string_view key) const;

    using Prim = std::shared_ptr<const UsdComposedPrim>;
    [[nodiscard]] Expected<Prim> root();
    [[nodiscard]] Expected<Prim> child(const UsdComposedPrim& parent, const std::string& name);
    /// Null where there is no such prim. Remembers what it has found.
    [[nodiscard]] Expected<Prim> at(const std::string& path);

private:
    using Site = UsdComposedPrim::Site;
    using Arc = UsdComposedPrim::Arc;
    using Index = std::vector<Site>;

    Expected<const UsdLayerStack*> stackOf(const std::shared_ptr<const UsdLayer>& layer);
    Expected<void> checkChoice(const UsdChoice& choice);
    /// What is odd in a layer, for the remarks.
    void remarkOf(const UsdLayer& layer);
    void remarkOfUnits(const UsdLayer& layer);
    void addSublayers(UsdLayerStack& stack, const std::shared_ptr<const UsdLayer>& layer, const UsdTime& time,
                      std::vector<std::string>& open);
    Expected<Index> indexOf(const UsdLayerStack& stack, const std::string& path);
    /// `ofInstance`: of an instanceable prim, of whose children nothing counts but what its own arcs bring.
    Expected<Index> childIndex(const Index& parent, const std::string& name, std::size_t depth, bool ofInstance);
    Expected<void> followArcs(Index& index, std::size_t depth);
    Expected<void> followArcsOf(Index& index, std::size_t site, std::size_t depth);
    Expected<void> addReference(Index& index, std::size_t site, const UsdReference& reference, const UsdOpinion& by,
                                Arc arc, std::size_t depth);
    /// `outer`: the stack's times in those of the index. `implied`: see addImplied.
    Expected<void> graft(Index& index, std::size_t site, const UsdLayerStack& stack, const std::string& path, Arc arc,
                         const UsdTime& outer, std::size_t depth, bool implied = false);
    /// A class that is named at a site counts wherever that is referred to, too: at `above` and all sites above that.
    Expected<void> addImplied(Index& index, std::size_t named, std::size_t above, std::size_t depth);
    /// `stagePath`: of the prim, where a person may have chosen; else empty.
    Expected<void> chooseVariants(Index& index, std::size_t depth, const std::string& stagePath);
    [[nodiscard]] static std::vector<std::size_t> byStrength(const Index& index);
    [[nodiscard]] bool goesInCircle(const Index& index, std::size_t site, const UsdLayerStack& stack,
                                    const std::string& path) const;
    /// Whether a site is there by an inherited or specialized class.
    [[nodiscard]] static bool isOfClass(const Index& index, std::size_t site);
    Expected<void> count(std::size_t sites);
    Expected<Prim> finish(Index index, std::string path);

    UsdFiles& files_;
    UsdRemarks& remarks_;
    std::size_t sites_ = 0, circles_ = 0;
    std::string circle_;                                                 ///< the first
    std::map<std::pair<std::string, std::string>, std::string> chosen_;  ///< variants, by prim and set
    const UsdLayerStack* root_ = nullptr;
    std::map<std::string, std::unique_ptr<UsdLayerStack>> stacks_;         ///< by their root's identifier
    std::vector<std::pair<const UsdLayerStack*, std::string>> following_;  ///< sites whose arcs are being followed
    std::map<std::string, Prim> known_;                                    ///< by path
};

}  // namespace tessera
