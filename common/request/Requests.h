/// All that applications may ask (the body of a Request), all that answers them (Reply) and all that they are told of
/// frames (Notice). A new request is described in the file of its topic, and listed at that file's end; what it does
/// stands in server/sim/desk.
#pragma once

#include <variant>

#include "common/request/AimRequests.h"
#include "common/request/CollisionRequests.h"
#include "common/request/EditRequests.h"
#include "common/request/FileRequests.h"
#include "common/request/PanelRequests.h"
#include "common/request/SceneRequests.h"
#include "common/request/StatusRequests.h"
#include "common/request/ViewRequests.h"

namespace tessera {

/// Of the alternatives of variants.
template <typename... Variants>
struct Joined;
template <typename... A>
struct Joined<std::variant<A...>> {
    using Type = std::variant<A...>;
};
template <typename... A, typename... B, typename... More>
struct Joined<std::variant<A...>, std::variant<B...>, More...> : Joined<std::variant<A..., B...>, More...> {};

/// Each file says which are its own, so that a request's name stands there alone.
using ApplicationRequest = Joined<request::OfEdits, request::OfScene, request::OfView, request::OfAims,
                                  request::OfCollisions, request::OfStatus, request::OfPanels, request::OfFiles>::Type;
/// Numbers that requests of older programs have: a server says in words that they are no longer understood.
inline constexpr std::array<std::uint8_t, 1> kFormerRequests{24};

using ApplicationAnswer =
    std::variant<answer::Done, answer::Committed, answer::Status, answer::Loaded, answer::Picked, answer::Contacts,
                 answer::Images, answer::PairEvents, answer::Distances, answer::Questions, answer::Objects,
                 answer::TreePage, answer::Trackers, answer::FoundPage, answer::Measured, answer::Identity,
                 answer::ArrayPiece, answer::Preview, answer::WallPlan, answer::People, answer::Steps,
                 answer::PanelState, answer::FolderPage, answer::Loads>;

using ApplicationNotice = std::variant<notice::Frame, answer::Contacts, answer::Picked, answer::PairEvents,
                                       answer::Distances, answer::Questions, notice::Poses, notice::States>;

[[nodiscard]] inline const RequestInfo& infoOf(const ApplicationRequest& request) {
    return std::visit([]<typename R>(const R&) -> const RequestInfo& { return R::kInfo; }, request);
}

}  // namespace tessera
