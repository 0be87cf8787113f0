#include "server/sim/desk/PanelRights.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <variant>

#include "common/codec/ChangeCodec.h"

namespace tessera {
namespace {

constexpr std::size_t kMostListBytes = std::size_t{64} << 10;
constexpr std::size_t kMostChanges = 256;

Error refused(const Panel& panel, std::string_view why) {
    return {ErrorCode::kRefused, fmt::format("the token is of the panel \"{}\": {}", panel.title, why)};
}

/// `inScene()`: the panel as it stands.
template <typename InScene>
std::optional<Error> whyNotList(const Panel& panel, const InScene& inScene, const ByteSlice& bytes, bool bringsArrays) {
    if (bringsArrays) return refused(panel, "it has no arrays");
    const BlobStore none;
    const Expected<ChangeList> list =
        decodeChangeList(bytes, none, AbsentBlobs::kRefuse, {.maxBytes = kMostListBytes, .maxChanges = kMostChanges});
    if (!list) return list.error();
    return inScene().whyNot(*list);
}

/// "#17"; none: it is a path.
std::optional<ObjectId> numberIn(const std::string& name) {
    std::uint64_t number = 0;
    const char* end = name.data() + name.size();
    if (!name.starts_with('#') || std::from_chars(name.data() + 1, end, number).ptr != end) return std::nullopt;
    return ObjectId(number);
}

/// Of a node that is not there either: what is said of such a path names the nodes beside it.
template <typename InScene>
std::optional<Error> whyNotNames(const Panel& panel, const InScene& inScene, const std::vector<std::string>& names) {
    if (names.empty()) return std::nullopt;
    const PanelInScene& there = inScene();
    for (const std::string& name : names) {
        const std::optional<ObjectId> number = numberIn(name);
        if (!(number ? there.holds(*number) : there.holds(name)))
            return refused(panel, fmt::format("it has no control of {}, or there is no such node now", name));
    }
    return std::nullopt;
}

std::optional<Error> whyNotFlight(const Panel& panel, const NavigationWish& wish) {
    const bool flies = wish.mode || wish.input || wish.deed == NavigationWish::Deed::kNone;
    const bool allowed = !flies && std::ranges::any_of(panel.controls, [&](const PanelControl& control) {
        const auto* press = std::get_if<PanelPress>(&control.as);
        if (!press) return false;
        if (wish.deed == NavigationWish::Deed::kHome) return press->home;
        return wish.deed == NavigationWish::Deed::kGoToBookmark && press->bookmark == wish.bookmark;
    });
    if (allowed) return std::nullopt;
    return refused(panel, "no control leads the view there");
}

}  // namespace

const PanelInScene& PanelRights::in(const std::shared_ptr<const Panel>& panel, const Aspect& scene, Sequence at) {
    const auto known = found_.find(panel.get());
    if (known != found_.end() && known->second.at == at) return known->second.there;
    constexpr std::size_t kMost = 64;
    if (known != found_.end()) found_.erase(known);
    if (found_.size() >= kMost) found_.clear();
    return found_.emplace(panel.get(), Standing{panel, at, PanelInScene(*panel, scene)}).first->second.there;
}

std::optional<Error> PanelRights::whyNot(const std::shared_ptr<const Panel>& known, const Aspect& scene, Sequence at,
                                         const ApplicationRequest& request) {
    const Panel& panel = *known;
    const auto inScene = [&]() -> const PanelInScene& { return in(known, scene, at); };
    return std::visit(
        [&]<typename Request>(const Request& said) -> std::optional<Error> {
            if constexpr (!Request::kInfo.forPanels)
                return refused(panel, "it does not say that");
            else if constexpr (requires { said.list; })
                return whyNotList(panel, inScene, said.list, !said.blobs.empty());
            else if constexpr (requires { said.wish.names; })
                return whyNotNames(panel, inScene, said.wish.names);
            else if constexpr (requires { said.wish.deed; })
                return whyNotFlight(panel, said.wish);
            else
                return std::nullopt;
        },
        request);
}

}  // namespace tessera
