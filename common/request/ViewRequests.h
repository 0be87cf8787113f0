/// Requests about what the wall shows, and where it stands in the world.
#pragma once

#include "common/request/EditRequests.h"
#include "common/wall/View.h"
#include "common/wall/Wall.h"

namespace tessera {

/// Moves the wall in the world, or a user's head in the wall. Unset parts stay. `reset`: back to the scene's camera.
struct ViewWish {
    std::optional<Vec3d> position;
    std::optional<Quatd> orientation;
    std::optional<double> worldUnitsPerMetre;
    std::string user;
    std::optional<Vec3d> head;
    bool reset = false;

    static constexpr std::string_view kName = "ViewWish";
    static constexpr auto members() {
        return std::tuple(member<&ViewWish::position>(1, "position")
                              .in("world units")
                              .between(-kMaxViewCoordinate, kMaxViewCoordinate)
                              .said("of the wall; absent: it stays"),
                          member<&ViewWish::orientation>(2, "orientation").said("of the wall; absent: it stays"),
                          member<&ViewWish::worldUnitsPerMetre>(3, "world_units_per_metre")
                              .between(kMinWorldUnitsPerMetre, kMaxWorldUnitsPerMetre)
                              .said("absent: it stays"),
                          member<&ViewWish::user>(4, "user").said("whose head it is"),
                          member<&ViewWish::head>(5, "head").in("m").said("in the wall's frame; absent: it stays"),
                          member<&ViewWish::reset>(6, "reset").said("back to the scene's camera"));
    }
};

/// Moves the wall as a person would who flies: first the mode, then what is asked for, then what is held. Refused by a
/// server that takes no input.
struct NavigationWish {
    enum class Deed : std::uint8_t {
        kNone,
        kHome,          ///< to the first view
        kFit,           ///< until `node`, or the whole scene, fills the wall
        kGoToBookmark,  ///< refused where nobody has kept it
        kKeepBookmark,  ///< where the wall stands now
    };
    std::optional<NavigationMode> mode;
    Deed deed = Deed::kNone;
    ObjectId node;               ///< of kFit; none: the whole scene
    std::uint32_t bookmark = 0;  ///< 1 to 9
    /// This application's own input from now on: its `source` does not count. It is released when the application
    /// leaves.
    std::optional<InputState> input;

    static constexpr std::string_view kName = "NavigationWish";
    static constexpr auto members() {
        return std::tuple(member<&NavigationWish::mode>(1, "mode").said("absent: it stays"),
                          member<&NavigationWish::deed>(2, "deed"),
                          member<&NavigationWish::node>(3, "node").said("of fit; 0: the whole scene"),
                          member<&NavigationWish::bookmark>(4, "bookmark")
                              .between(1, kBookmarks)
                              .onlyWhen(&NavigationWish::speaksOfBookmark, "with deed go_to_bookmark or keep_bookmark"),
                          partMember<&NavigationWish::input>("input").said(
                              "what this application holds from now on; nothing: as it was"));
    }
    [[nodiscard]] static bool speaksOfBookmark(const NavigationWish& wish) {
        return wish.deed == Deed::kGoToBookmark || wish.deed == Deed::kKeepBookmark;
    }
};
template <>
struct WordsOf<NavigationWish::Deed> {
    static constexpr std::array<std::string_view, 5> kWords{"none", "home", "fit", "go_to_bookmark", "keep_bookmark"};
};

namespace answer {

struct TileImageValue {
    std::string tile, host;
    FrameNumber frame;
    ByteSlice png;

    static constexpr std::string_view kName = "TileImage";
    static constexpr auto members() {
        return std::tuple(member<&TileImageValue::tile>(1, "tile"), member<&TileImageValue::host>(2, "host"),
                          member<&TileImageValue::frame>(3, "frame"),
                          partMember<&TileImageValue::png>("png").holding(Holds::kPicture).said("the picture"));
    }
};
struct Images {
    std::vector<TileImageValue> tiles;
    std::vector<std::string> missing;  ///< tiles of hosts that are not there

    static constexpr ToldInfo kInfo{.name = "Images", .answer = 7, .help = "The tiles of one frame"};
    static constexpr auto members() {
        return std::tuple(member<&Images::tiles>(1, "tiles").atMost(&ApplicationLimits::maxTiles),
                          member<&Images::missing>(2, "missing")
                              .atMost(&ApplicationLimits::maxTiles)
                              .said("tiles of hosts that are not there"));
    }
};

}  // namespace answer

namespace request {

struct SetView {
    ViewWish wish;

    using Answer = answer::Done;
    static constexpr RequestInfo kInfo{.number = 5,
                                       .name = "SetView",
                                       .role = Role::kEditor,
                                       .answered = Answered::kLater,
                                       .changes = Changes::kView,
                                       .help = "Moves the wall in the world, or a user's head before the wall",
                                       .example = R"({"position":[0,2,6],"world_units_per_metre":1.5})"};
    static constexpr auto members() { return std::tuple(spreadMember<&SetView::wish>(1)); }
};

struct NavigateView {
    NavigationWish wish;

    using Answer = answer::Done;
    static constexpr RequestInfo kInfo{.number = 18,
                                       .name = "NavigateView",
                                       .role = Role::kEditor,
                                       .changes = Changes::kView,
                                       .help = "Flies, orbits or walks, goes home, to a node or to a bookmark",
                                       .forPanels = true,
                                       .example = R"({"mode":"orbit","deed":"keep_bookmark","bookmark":1})"};
    static constexpr auto members() { return std::tuple(spreadMember<&NavigateView::wish>(1)); }
};

/// What all tiles show from the next frame on.
struct ShowPicture {
    Showing showing = Showing::kScene;

    using Answer = answer::Done;
    static constexpr RequestInfo kInfo{.number = 19,
                                       .name = "ShowPicture",
                                       .role = Role::kOperator,
                                       .help = "Shows the scene, or a test picture, on all tiles",
                                       .example = R"({"showing":"scene"})"};
    static constexpr auto members() { return std::tuple(member<&ShowPicture::showing>(1, "showing")); }
};

/// That hosts may take for a frame from the next one on before detail is left away (common/wall/Detail.h). 0: none is.
struct SetBudget {
    double milliseconds = 0;

    using Answer = answer::Done;
    static constexpr RequestInfo kInfo{.number = 23,
                                       .name = "SetBudget",
                                       .role = Role::kOperator,
                                       .help = "How long a frame may take before detail is left away",
                                       .example = R"({"milliseconds":12})"};
    static constexpr auto members() {
        return std::tuple(member<&SetBudget::milliseconds>(1, "milliseconds")
                              .in("ms")
                              .between(kLeastBudgetMs, kMostBudgetMs)
                              .orExactly(0)
                              .said("for a frame; 0: no detail is left away"));
    }
};

/// The wall as it is now: one TileImage per tile.
struct GetImages {
    using Answer = answer::Images;
    static constexpr RequestInfo kInfo{.number = 8,
                                       .name = "GetImages",
                                       .answered = Answered::kLater,
                                       .help = "The pictures of all tiles, of one frame"};
    static constexpr auto members() { return std::tuple(); }
};

using OfView = std::variant<SetView, NavigateView, ShowPicture, SetBudget, GetImages>;

}  // namespace request

/// As the house calls it, where it asks by itself.
using ImagesQuestion = request::GetImages;

}  // namespace tessera
