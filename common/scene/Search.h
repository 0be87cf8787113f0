/// Which nodes does an expression name?
///
///     /hall/crane            the node of that path        /hall/wheel?         one character more
///     wheel*  or  //wheel*   anywhere                     /hall/**/wheel*      anywhere below /hall, its children too
///     /hall/*[Geometry]      nodes with such a core       //crane[visible]/*   below cranes that no Switch hides
///
/// expression: steps, each after "/" (one level down) or "//" (any number of levels). A text that begins with no "/"
/// stands for "//" and itself; "/" alone for the node where the search begins. step: a name, in which "*" stands for
/// any characters and "?" for one (never for a
/// "/" of the expression), "**" for any number of levels and at the end for all that is below; then any number of
/// conditions in brackets: the name of a type of core, "visible", "hidden". "\" before a character takes it as it is.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "common/base/Error.h"
#include "common/scene/Aspect.h"

namespace tessera {

/// What an expression says, taken apart. Immutable; copies are cheap.
class PathPattern {
public:
    static constexpr std::size_t kMaxBytes = 256, kMaxSteps = 32;

    /// kUsage: says what is wrong, and where. kLimit: too long.
    [[nodiscard]] static Expected<PathPattern> parse(std::string_view expression);

    /// How far a way down from the top has been followed: a bit for each number of steps that fit it.
    using Progress = std::uint64_t;
    [[nodiscard]] static Progress atTop() { return 1; }
    struct Candidate {
        std::string_view name;
        ObjectType coreType;  ///< none: it has no core
        bool visible = true;
    };
    /// One node further down. Adds to `work` how many characters were looked at: at most those of the name times those
    /// of the expression.
    [[nodiscard]] Progress follow(Progress parent, const Candidate& node, std::size_t& work) const;
    /// The way ends at a node that is meant.
    [[nodiscard]] bool names(Progress progress) const;
    /// Below it there may be more.
    [[nodiscard]] bool leadsOn(Progress progress) const;

private:
    struct Step;
    std::shared_ptr<const std::vector<Step>> steps_;
};

struct SearchOptions {
    ObjectId top = kRootNode;  ///< the "/" of the expression
    ObjectType coreType;       ///< only nodes with such a core; none: any
    /// Of one page: nodes told, nodes looked at, characters compared. Whatever ends it first, one node at least is
    /// looked at.
    std::size_t maxFound = 512, maxLookedAt = 8192, maxWork = 1'000'000;
    std::vector<ObjectId> after;  ///< `SearchPage::next` of the page before; empty: from the start
};
struct SearchPage {
    std::vector<ObjectId> found;  ///< in the order of the document; each once
    std::vector<ObjectId> next;   ///< the way down to the node looked at last; empty: this is the last page
    std::size_t lookedAt = 0;
};

/// A page of what the pattern names, at a bounded cost: it may find nothing and not be the last. While the scene
/// changes between pages, what stays in its place is told once (where a node of `after` has gone or moved perhaps
/// twice; where one has moved among its own siblings, those passed by perhaps not), what comes, goes or moves is told
/// or not. kNotFound: `top` is no node. kBadInput: `after` leads down from another one.
[[nodiscard]] Expected<SearchPage> searchPage(const Aspect& aspect, const PathPattern& pattern,
                                              const SearchOptions& options);

/// Whether no Switch above the node shows another of its children instead.
[[nodiscard]] bool isShown(const Aspect& aspect, ObjectId node);

}  // namespace tessera
