/// Requests that point at something: picks, and the handles of manipulators (server/manipulators).
#pragma once

#include "common/request/EditRequests.h"

namespace tessera {

/// How applications point: at a pixel of the mosaic, from its upper left; with a wand; along a ray of the world.
struct Aim {
    double xPx = 0, yPx = 0;
    std::string wand;             ///< instead of the pixel; empty: the pixel
    std::optional<Ray> ray = {};  ///< instead of both

    static constexpr std::string_view kName = "Aim";
    static constexpr void members(auto&& take) {
        take(member<&Aim::xPx>(1, "x_px").in("px").said("of the first screen's mosaic, from the left"),
             member<&Aim::yPx>(2, "y_px").in("px").said("from above"),
             member<&Aim::wand>(3, "wand").said("along its ray instead"),
             member<&Aim::ray>(4, "ray").said("along this one instead"));
    }
};

namespace answer {

struct Picked {
    bool hit = false;
    ObjectId node;
    std::uint32_t face = 0;
    Vec3d point = Vec3d::Zero();
    double xPx = 0, yPx = 0;
    double t = 0;                   ///< how far from where the ray begins (the eye, the wand), in world units
    Vec3d normal = Vec3d::Zero();   ///< of the face, world, of length 1, as its corners turn; zero of a ball and of a
                                    ///< face without area
    Vec2d corners = Vec2d::Zero();  ///< barycentric: how much of the face's second and third corner
    std::optional<Vec2d> texcoord;  ///< of the first set, where the geometry has one

    static constexpr ToldInfo kInfo{.name = "Picked", .answer = 5, .notice = 3, .help = "What was pointed at"};
    static constexpr void members(auto&& take) {
        take(member<&Picked::hit>(1, "hit"), member<&Picked::node>(2, "node"),
             member<&Picked::face>(3, "face").said("of a grab the handle's number"),
             member<&Picked::point>(4, "point").in("world units"), member<&Picked::xPx>(5, "x_px").in("px"),
             member<&Picked::yPx>(6, "y_px").in("px"),
             member<&Picked::t>(7, "t").in("world units").said("from where the ray begins"),
             member<&Picked::normal>(8, "normal").said("of the face, of length 1; zero where there is none"),
             numbersMember<&Picked::corners>(9, "second", "third")
                 .said("with the next: barycentric weights of the face's second and third corner"),
             numbersMember<&Picked::texcoord>(11, "texcoord_u", "texcoord_v", "has_texcoord")
                 .said("with the next: of the first set"));
    }
};

/// How far it is from a place to another, or to the nearest surface that is seen.
struct Measured {
    Vec3d from = Vec3d::Zero(), to = Vec3d::Zero();
    double distance = 0;
    double error = 0;  ///< the truth is within this of `distance`; 0: exact to rounding
    ObjectId node;     ///< whose surface it is; none: it was measured to a place
    std::uint32_t face = 0;
    Vec3d normal = Vec3d::Zero();  ///< of the face, world, of length 1; zero of a ball and of a face without area

    static constexpr ToldInfo kInfo{.name = "Measured", .answer = 14, .help = "How far it is"};
    static constexpr void members(auto&& take) {
        take(member<&Measured::from>(1, "from").in("world units"), member<&Measured::to>(2, "to").in("world units"),
             member<&Measured::distance>(3, "distance").in("world units"),
             member<&Measured::error>(4, "error").in("world units").said("the truth is within it"),
             member<&Measured::node>(5, "node").said("whose surface it is; 0: measured to a place"),
             member<&Measured::face>(6, "face"),
             member<&Measured::normal>(7, "normal").said("of the face; zero where there is none"));
    }
};

}  // namespace answer

namespace request {

struct PickAt {
    Aim aim;

    using Answer = answer::Picked;
    static constexpr RequestInfo kInfo{.number = 6,
                                       .name = "PickAt",
                                       .help = "What is at a pixel, or along a wand or a ray",
                                       .example = R"({"ray":{"origin":[0,1,20],"direction":[0,0,-1]}})"};
    static constexpr void members(auto&& take) { take(spreadMember<&PickAt::aim>(1)); }
};

/// An application holds one at a time; what it drags from a grab on is one step of undo, and it lets go when it leaves.
/// Answered by the manipulator's node, and the handle's number as `face`.
struct GrabHandle {
    Aim aim;

    using Answer = answer::Picked;
    static constexpr RequestInfo kInfo{.number = 27,
                                       .name = "GrabHandle",
                                       .role = Role::kEditor,
                                       .changes = Changes::kScene,
                                       .help = "Takes hold of a manipulator's handle",
                                       .example = R"({"ray":{"origin":[0,1.5,20],"direction":[0,0,-1]}})"};
    static constexpr void members(auto&& take) { take(spreadMember<&GrabHandle::aim>(1)); }
};

/// Answered once the frame is made; refused where nothing is held.
struct DragHandle {
    Aim aim;

    using Answer = answer::Committed;
    static constexpr RequestInfo kInfo{.number = 28,
                                       .name = "DragHandle",
                                       .role = Role::kEditor,
                                       .answered = Answered::kLater,
                                       .changes = Changes::kScene,
                                       .help = "Leads the handle that is held to another place",
                                       .example = R"({"ray":{"origin":[0,2,20],"direction":[0,0,-1]}})"};
    static constexpr void members(auto&& take) { take(spreadMember<&DragHandle::aim>(1)); }
};

struct ReleaseHandle {
    using Answer = answer::Done;
    static constexpr RequestInfo kInfo{
        .number = 29, .name = "ReleaseHandle", .role = Role::kEditor, .help = "Lets go of the handle that is held"};
    static constexpr void members(auto&& take) { take(); }
};

/// To a place, or to the nearest surface that a pick could meet at or below a node.
struct MeasureDistance {
    Vec3d from = Vec3d::Zero();
    std::optional<Vec3d> to = {};
    ObjectId node = {};

    using Answer = answer::Measured;
    static constexpr RequestInfo kInfo{.number = 30,
                                       .name = "MeasureDistance",
                                       .help = "How far it is from a place to a place, or to a node's surface",
                                       .example = R"({"from":[0,5,0],"node":"/hall/crane"})"};
    static constexpr void members(auto&& take) {
        take(member<&MeasureDistance::from>(1, "from").in("world units"),
             member<&MeasureDistance::to>(2, "to").in("world units").said("absent: to the node"),
             member<&MeasureDistance::node>(3, "node").said("0: to the place"));
    }
    [[nodiscard]] std::optional<std::string> fault() const {
        if (to.has_value() != bool(node)) return std::nullopt;
        return to ? "a place to measure to, and a node: only one of them can be" : "no place and no node to measure to";
    }
};

using OfAims = std::variant<PickAt, GrabHandle, DragHandle, ReleaseHandle, MeasureDistance>;

}  // namespace request
}  // namespace tessera
