/// Requests about what the wall shows, and where it stands in the world.
#pragma once

#include "common/request/EditRequests.h"
#include "common/wall/View.h"
#include "common/wall/Wall.h"

namespace tessera {

inline constexpr std::uint32_t kMostPreviewShrink = 64;

/// Moves the wall in the world, or a user's head in the wall. Unset parts stay. `reset`: back to the scene's camera.
struct ViewWish {
    std::optional<Vec3d> position;
    std::optional<Quatd> orientation;
    std::optional<double> worldUnitsPerMetre;
    std::string user;
    std::optional<Vec3d> head;
    bool reset = false;

    static constexpr std::string_view kName = "ViewWish";
    static constexpr void members(auto&& take) {
        take(member<&ViewWish::position>(1, "position")
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
    static constexpr void members(auto&& take) {
        take(member<&NavigationWish::mode>(1, "mode").said("absent: it stays"),
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
    static constexpr void members(auto&& take) {
        take(member<&TileImageValue::tile>(1, "tile"), member<&TileImageValue::host>(2, "host"),
             member<&TileImageValue::frame>(3, "frame"),
             partMember<&TileImageValue::png>("png").holding(Holds::kPicture).said("the picture"));
    }
};
struct Images {
    std::vector<TileImageValue> tiles;
    std::vector<std::string> missing;  ///< tiles of hosts that are not there

    static constexpr ToldInfo kInfo{.name = "Images", .answer = 7, .help = "The tiles of one frame"};
    static constexpr void members(auto&& take) {
        take(member<&Images::tiles>(1, "tiles").atMost(&ApplicationLimits::maxTiles),
             member<&Images::missing>(2, "missing")
                 .atMost(&ApplicationLimits::maxTiles)
                 .said("tiles of hosts that are not there"));
    }
};

struct TilePreview {
    std::string tile, host;
    FrameNumber frame;
    ByteSlice jpeg;

    static constexpr std::string_view kName = "TilePreview";
    static constexpr void members(auto&& take) {
        take(member<&TilePreview::tile>(1, "tile"), member<&TilePreview::host>(2, "host"),
             member<&TilePreview::frame>(3, "frame"),
             partMember<&TilePreview::jpeg>("jpeg").holding(Holds::kJpeg).said("the picture"));
    }
};
struct Preview {
    std::uint64_t stamp = 0;
    std::vector<TilePreview> tiles;
    std::vector<std::string> missing;

    static constexpr ToldInfo kInfo{.name = "Preview", .answer = 21, .help = "Tiles that show something else now"};
    static constexpr void members(auto&& take) {
        take(member<&Preview::stamp>(1, "stamp").said("for `after` of the next request"),
             member<&Preview::tiles>(2, "tiles").atMost(&ApplicationLimits::maxTiles),
             member<&Preview::missing>(3, "missing")
                 .atMost(&ApplicationLimits::maxTiles)
                 .said("tiles of hosts that are not there"));
    }
};

struct ScreenPlan {
    std::string name;
    Vec3d lowerLeft = Vec3d::Zero(), lowerRight = Vec3d::Zero(), upperLeft = Vec3d::Zero();
    std::uint32_t width = 0, height = 0, mosaicWidth = 0, mosaicHeight = 0;

    static constexpr std::string_view kName = "ScreenPlan";
    static constexpr void members(auto&& take) {
        take(member<&ScreenPlan::name>(1, "name"),
             member<&ScreenPlan::lowerLeft>(2, "lower_left").in("m").said("in the wall's frame"),
             member<&ScreenPlan::lowerRight>(3, "lower_right").in("m"),
             member<&ScreenPlan::upperLeft>(4, "upper_left").in("m"),
             member<&ScreenPlan::width>(5, "width").in("px").said("those behind bezels, too"),
             member<&ScreenPlan::height>(6, "height").in("px"),
             member<&ScreenPlan::mosaicWidth>(7, "mosaic_width")
                 .in("px")
                 .said("of what tiles show, put together without gaps"),
             member<&ScreenPlan::mosaicHeight>(8, "mosaic_height").in("px"));
    }
};
struct TilePlan {
    std::string name, screen, host, user;
    Eye eye = Eye::kCenter;
    std::uint32_t x = 0, y = 0, width = 0, height = 0;
    Vec3d lowerLeft = Vec3d::Zero(), lowerRight = Vec3d::Zero(), upperLeft = Vec3d::Zero();
    Vec3d seenFrom = Vec3d::Zero();
    std::uint32_t mosaicX = 0, mosaicY = 0;

    static constexpr std::string_view kName = "TilePlan";
    static constexpr void members(auto&& take) {
        take(member<&TilePlan::name>(1, "name"), member<&TilePlan::screen>(2, "screen"),
             member<&TilePlan::host>(3, "host"), member<&TilePlan::user>(4, "user"), member<&TilePlan::eye>(5, "eye"),
             member<&TilePlan::x>(6, "x").in("px").said("from the left of its screen"),
             member<&TilePlan::y>(7, "y").in("px").said("from the top of its screen"),
             member<&TilePlan::width>(8, "width").in("px"), member<&TilePlan::height>(9, "height").in("px"),
             member<&TilePlan::lowerLeft>(10, "lower_left").in("m").said("in the wall's frame"),
             member<&TilePlan::lowerRight>(11, "lower_right").in("m"),
             member<&TilePlan::upperLeft>(12, "upper_left").in("m"),
             member<&TilePlan::seenFrom>(13, "seen_from")
                 .in("m")
                 .said("the eye that it is drawn for now, in the wall's frame"),
             member<&TilePlan::mosaicX>(14, "mosaic_x").in("px").said("in its screen's mosaic"),
             member<&TilePlan::mosaicY>(15, "mosaic_y").in("px").said("from above"));
    }
};
struct UserPlan {
    std::string name;
    Vec3d position = Vec3d::Zero();

    static constexpr std::string_view kName = "UserPlan";
    static constexpr void members(auto&& take) {
        take(member<&UserPlan::name>(1, "name"),
             member<&UserPlan::position>(2, "position").in("m").said("of the head, as the wall's file has it"));
    }
};
struct WallPlan {
    std::string name;
    std::vector<ScreenPlan> screens;
    std::vector<TilePlan> tiles;
    std::vector<UserPlan> users;
    // Where it stands in the world now; nothing: the camera that it is to stand at is not there.
    std::optional<Vec3d> position;
    std::optional<Quatd> orientation;
    std::optional<double> worldUnitsPerMetre;

    static constexpr ToldInfo kInfo{.name = "WallPlan", .answer = 22, .help = "Where screens, tiles and users are"};
    static constexpr void members(auto&& take) {
        take(member<&WallPlan::name>(1, "name"),
             member<&WallPlan::screens>(2, "screens").atMost(&ApplicationLimits::maxScreens),
             member<&WallPlan::tiles>(3, "tiles").atMost(&ApplicationLimits::maxTiles),
             member<&WallPlan::users>(4, "users").atMost(&ApplicationLimits::maxScreens),
             member<&WallPlan::position>(5, "position")
                 .in("world units")
                 .said("of the wall now; with the next two absent where no camera is there to stand at"),
             member<&WallPlan::orientation>(6, "orientation"),
             member<&WallPlan::worldUnitsPerMetre>(7, "world_units_per_metre"));
    }
};

}  // namespace answer
template <>
struct WordsOf<Eye> {
    static constexpr std::array<std::string_view, 3> kWords{"center", "left", "right"};
};

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
    static constexpr void members(auto&& take) { take(spreadMember<&SetView::wish>(1)); }
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
    static constexpr void members(auto&& take) { take(spreadMember<&NavigateView::wish>(1)); }
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
    static constexpr void members(auto&& take) { take(member<&ShowPicture::showing>(1, "showing")); }
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
    static constexpr void members(auto&& take) {
        take(member<&SetBudget::milliseconds>(1, "milliseconds")
                 .in("ms")
                 .between(kLeastBudgetMs, kMostBudgetMs)
                 .orExactly(0)
                 .said("for a frame; 0: no detail is left away"));
    }
};

/// How bright the wall shows its scene from the next frame on, in place of what the scene's Environment says.
struct SetExposure {
    ExposureWish wish;
    bool reset = false;

    using Answer = answer::Done;
    static constexpr RequestInfo kInfo{.number = 42,
                                       .name = "SetExposure",
                                       .role = Role::kEditor,
                                       .help = "How bright the wall shows its scene, whatever that says",
                                       .example = R"({"metered":true,"tone_map":"agx"})"};
    static constexpr void members(auto&& take) {
        take(spreadMember<&SetExposure::wish>(1),
             member<&SetExposure::reset>(4, "reset").said("first back to what the scene says"));
    }
};

/// The wall as it is now: one TileImage per tile.
struct GetImages {
    using Answer = answer::Images;
    static constexpr RequestInfo kInfo{.number = 8,
                                       .name = "GetImages",
                                       .answered = Answered::kLater,
                                       .help = "The pictures of all tiles, of one frame"};
    static constexpr void members(auto&& take) { take(); }
};

/// Small pictures of what the wall shows, again and again: each answer is what has changed since the last one.
struct GetPreview {
    std::uint32_t shrink = 2;
    std::uint64_t after = 0;

    using Answer = answer::Preview;
    static constexpr RequestInfo kInfo{.number = 33,
                                       .name = "GetPreview",
                                       .answered = Answered::kLater,
                                       .help = "Small pictures of tiles that have changed, at most 15 times a second",
                                       .ownLink = true,
                                       .example = R"({"shrink":2})"};
    static constexpr void members(auto&& take) {
        take(member<&GetPreview::shrink>(1, "shrink")
                 .between(1, kMostPreviewShrink)
                 .said("pixels of a tile for one of its picture, each way: 1, 2, 4, ... 64"),
             member<&GetPreview::after>(2, "after").said("the stamp of the last answer; 0: all"));
    }
};

struct GetWall {
    using Answer = answer::WallPlan;
    static constexpr RequestInfo kInfo{
        .number = 34, .name = "GetWall", .help = "Where the wall's screens, tiles and users are, and the wall itself"};
    static constexpr void members(auto&& take) { take(); }
};

using OfView = std::variant<SetView, NavigateView, ShowPicture, SetBudget, SetExposure, GetImages, GetPreview, GetWall>;

}  // namespace request

/// As the house calls it, where it asks by itself.
using ImagesQuestion = request::GetImages;

}  // namespace tessera
