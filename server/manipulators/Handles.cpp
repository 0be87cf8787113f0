#include "server/manipulators/Handles.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/math/Decompositions.h"

namespace tessera {
namespace {

constexpr double kThin = 0.025;  ///< of what is one unit large
constexpr std::array<HandleColor, 3> kAxisColors{HandleColor::kRed, HandleColor::kGreen, HandleColor::kBlue};

MeshData turned(const MeshData& mesh, const Affine3d& place) {
    MeshData out;
    out.append(mesh, place);
    return out;
}

/// From what stands along +Y to what stands along +Z.
Affine3d yToZ() {
    return Affine3d(turnBetween(Vec3d::UnitY(), Vec3d::UnitZ()));
}

MeshData makeCone() {
    constexpr int kSides = 16;
    MeshData mesh;
    const auto add = [&](double x, double y, double z) {
        for (const double v : {x, y, z}) mesh.positions.push_back(static_cast<float>(v));
    };
    add(0, 0, 1);
    add(0, 0, 0);
    for (int i = 0; i < kSides; ++i) {
        const double a = 2 * std::numbers::pi * i / kSides;
        add(std::cos(a), std::sin(a), 0);
    }
    for (std::uint32_t i = 0; i < kSides; ++i) {
        const std::uint32_t a = 2 + i, b = 2 + (i + 1) % kSides;
        mesh.indices.insert(mesh.indices.end(), {a, b, 0, b, a, 1});
    }
    return mesh;
}

/// The rotation that brings Z to an axis.
Quatd towards(const Vec3d& direction) {
    return turnBetween(Vec3d::UnitZ(), direction);
}

/// Puts the pieces of a kind together. A length of the extent is kept apart from that of knobs, so that knobs of a flat
/// box are cubes.
class Assembly {
public:
    Assembly(const Vec3d& extent, double knob) : extent_(extent), knob_(knob > 0 ? knob : extent.maxCoeff()) {}

    std::int64_t add(HandleDeed deed, int axis = 0, const Vec3d& fixed = Vec3d::Zero()) {
        all_.of.push_back({.deed = deed, .axis = axis, .fixed = fixed});
        return static_cast<std::int64_t>(all_.of.size());
    }
    void piece(std::int64_t handle, HandleShape shape, HandleColor color, const Vec3d& at, const Quatd& rotation,
               const Vec3d& scale, bool shown = true) {
        all_.pieces.push_back({.handle = handle,
                               .shape = shape,
                               .color = color,
                               .pose = {.translation = at, .rotation = rotation, .scale = scale},
                               .shown = shown});
    }
    void rod(std::int64_t handle, HandleColor color, const Vec3d& from, const Vec3d& to, double thickness = kThin) {
        const double length = (to - from).norm();
        piece(handle, HandleShape::kRod, color, from, length > 0 ? towards((to - from) / length) : Quatd::Identity(),
              Vec3d(thickness * knob_, thickness * knob_, length));
    }
    void cube(std::int64_t handle, HandleColor color, const Vec3d& at, double half) {
        piece(handle, HandleShape::kCube, color, at, Quatd::Identity(), Vec3d::Constant(half * knob_));
    }
    void ball(std::int64_t handle, HandleColor color, const Vec3d& at, double radius, bool shown = true) {
        piece(handle, HandleShape::kBall, color, at, Quatd::Identity(), Vec3d::Constant(radius * knob_), shown);
    }
    /// An arrow from the centre along an axis.
    void arrow(std::int64_t handle, HandleColor color, const Vec3d& direction, double length = 1) {
        const Vec3d tip = direction * length * knob_;
        rod(handle, color, Vec3d::Zero(), 0.8 * tip);
        piece(handle, HandleShape::kCone, color, 0.8 * tip, towards(direction),
              knob_ * Vec3d(0.07, 0.07, 0.2 * length));
    }
    void moves(double length = 1) {
        for (int i = 0; i < 3; ++i)
            arrow(add(HandleDeed::kMoveAxis, i), kAxisColors[static_cast<std::size_t>(i)], Vec3d::Unit(i), length);
    }
    void rings() {
        for (int i = 0; i < 3; ++i)
            piece(add(HandleDeed::kTurnRing, i), HandleShape::kRing, kAxisColors[static_cast<std::size_t>(i)],
                  Vec3d::Zero(), towards(Vec3d::Unit(i)), Vec3d::Constant(knob_));
    }
    /// Seen by rays alone: what is within the rings stays to be seen.
    void hiddenBall() { ball(add(HandleDeed::kTurnBall), HandleColor::kWhite, Vec3d::Zero(), 1, false); }
    /// Its edges, and its faces, which rays alone see: a face moves in its plane. An edge does what the face does that
    /// it bounds, or turns about itself.
    enum class Edges : std::uint8_t { kMove, kTurn };
    void box(Edges edges = Edges::kMove) {
        const std::int64_t first = add(HandleDeed::kMovePlane, 0);
        add(HandleDeed::kMovePlane, 1);
        add(HandleDeed::kMovePlane, 2);
        for (int axis = 0; axis < 3; ++axis) {
            const int b = (axis + 1) % 3, c = (axis + 2) % 3;
            const std::int64_t turn = edges == Edges::kTurn ? add(HandleDeed::kTurnRing, axis) : 0;
            for (const double side : {-1.0, 1.0}) {
                Vec3d half = extent_;
                half[axis] = 1e-4 * extent_.maxCoeff();
                piece(first + axis, HandleShape::kCube, HandleColor::kWhite, side * extent_[axis] * Vec3d::Unit(axis),
                      Quatd::Identity(), half, false);
                for (const double other : {-1.0, 1.0}) {  // the four edges along this axis; their faces move across b
                    Vec3d from = side * extent_[b] * Vec3d::Unit(b) + other * extent_[c] * Vec3d::Unit(c);
                    Vec3d to = from;
                    from[axis] = -extent_[axis];
                    to[axis] = extent_[axis];
                    if (turn > 0)
                        rod(turn, kAxisColors[static_cast<std::size_t>(axis)], from, to);
                    else
                        rod(first + b, HandleColor::kWhite, from, to, 0.012);
                }
            }
        }
    }
    void corners(bool aboutOpposite, HandleColor color, double half) {
        for (int corner = 0; corner < 8; ++corner) {
            const Vec3d at(corner & 1 ? extent_.x() : -extent_.x(), corner & 2 ? extent_.y() : -extent_.y(),
                           corner & 4 ? extent_.z() : -extent_.z());
            cube(add(HandleDeed::kScaleAll, 0, aboutOpposite ? Vec3d(-at) : Vec3d(Vec3d::Zero())), color, at, half);
        }
    }
    [[nodiscard]] const Vec3d& extent() const { return extent_; }
    [[nodiscard]] double knob() const { return knob_; }
    [[nodiscard]] Handles take() { return std::move(all_); }

private:
    Vec3d extent_;
    double knob_;
    Handles all_;
};

}  // namespace

const MeshArrays& handleShape(HandleShape shape) {
    static const std::array<MeshArrays, kHandleShapes> shapes = [] {
        Affine3d rod = Affine3d::Identity();
        rod.translation() = Vec3d(0, 0, 0.5);
        rod = rod * yToZ();
        return std::array<MeshArrays, kHandleShapes>{turned(makeCylinder(1, 1, 12), rod).toArrays(),
                                                     makeCone().toArrays(), makeBox(Vec3d::Constant(2)).toArrays(),
                                                     makeSphere(1, 24).toArrays(),
                                                     turned(makeTorus(1, kRingTube, 64, 8), yToZ()).toArrays()};
    }();
    return shapes[static_cast<std::size_t>(shape)];
}

Handles handlesOf(std::int64_t kind, const Vec3d& extent, double outerAngle, double knob) {
    using M = Manipulator;
    Assembly made(extent, isBoxKind(kind) ? knob : 0);
    const double s = made.knob();
    const auto axisColor = [](int axis) { return kAxisColors[static_cast<std::size_t>(axis)]; };
    switch (kind) {
        case M::kMove:
            made.moves();
            for (int i = 0; i < 3; ++i) {  // a tile between the two other axes
                Vec3d at = Vec3d::Constant(0.35 * s), half = Vec3d::Constant(0.1 * s);
                at[i] = 0;
                half[i] = 0.01 * s;
                made.piece(made.add(HandleDeed::kMovePlane, i), HandleShape::kCube, axisColor(i), at, Quatd::Identity(),
                           half);
            }
            break;
        case M::kRotate:
            made.rings();
            break;
        case M::kScale:
            for (int i = 0; i < 3; ++i) {
                const std::int64_t handle = made.add(HandleDeed::kScaleAxis, i);
                made.rod(handle, axisColor(i), Vec3d::Zero(), Vec3d(0.95 * s * Vec3d::Unit(i)));
                made.cube(handle, axisColor(i), Vec3d(0.95 * s * Vec3d::Unit(i)), 0.07);
            }
            {
                const std::int64_t all = made.add(HandleDeed::kScaleAll);
                made.rod(all, HandleColor::kWhite, Vec3d::Zero(), Vec3d::Constant(0.5 * s));
                made.cube(all, HandleColor::kWhite, Vec3d::Constant(0.5 * s), 0.07);
            }
            break;
        case M::kTrackball:
            made.rings();
            made.hiddenBall();
            break;
        case M::kCenterball:
            made.rings();
            made.hiddenBall();
            for (int i = 0; i < 3; ++i) {  // reaches out of the ball, or no ray would find it
                const std::int64_t center = made.add(HandleDeed::kMoveCenter, i);
                made.rod(center, axisColor(i), Vec3d(-1.3 * s * Vec3d::Unit(i)), Vec3d(1.3 * s * Vec3d::Unit(i)));
                made.ball(center, axisColor(i), Vec3d(1.3 * s * Vec3d::Unit(i)), 0.07);
            }
            break;
        case M::kTabBox:
            made.box();
            made.corners(true, HandleColor::kWhite, 0.05);
            for (int i = 0; i < 3; ++i)
                for (const double side : {-1.0, 1.0}) {
                    const Vec3d at = side * extent[i] * Vec3d::Unit(i);
                    made.cube(made.add(HandleDeed::kScaleAxis, i, -at), axisColor(i), at, 0.06);
                }
            break;
        case M::kJack: {
            const std::int64_t turn = made.add(HandleDeed::kTurnBall), scale = made.add(HandleDeed::kScaleAll),
                               move = made.add(HandleDeed::kMoveFacing);
            for (int i = 0; i < 3; ++i) {
                made.rod(turn, axisColor(i), Vec3d(-0.9 * s * Vec3d::Unit(i)), Vec3d(0.9 * s * Vec3d::Unit(i)), 0.035);
                for (const double side : {-1.0, 1.0})
                    made.cube(scale, axisColor(i), Vec3d(side * 0.95 * s * Vec3d::Unit(i)), 0.08);
            }
            made.ball(move, HandleColor::kWhite, Vec3d::Zero(), 0.15);
            break;
        }
        case M::kTransformer:
            made.box();
            made.corners(false, HandleColor::kWhite, 0.05);
            for (int i = 0; i < 3; ++i)
                for (const double side : {-1.0, 1.0}) {
                    const std::int64_t turn = made.add(HandleDeed::kTurnBall);
                    const Vec3d from = side * extent[i] * Vec3d::Unit(i), to = from + side * 0.4 * s * Vec3d::Unit(i);
                    made.rod(turn, axisColor(i), from, to);
                    made.ball(turn, axisColor(i), to, 0.08);
                }
            break;
        case M::kHandleBox:
            made.box();
            made.corners(true, HandleColor::kWhite, 0.05);
            for (int i = 0; i < 3; ++i)  // cubes before the faces, on lines from the centre
                for (const double side : {-1.0, 1.0}) {
                    const std::int64_t stretch =
                        made.add(HandleDeed::kScaleAxis, i, Vec3d(-side * extent[i] * Vec3d::Unit(i)));
                    const Vec3d to = side * (extent[i] + 0.3 * s) * Vec3d::Unit(i);
                    made.rod(stretch, HandleColor::kWhite, Vec3d::Zero(), to, 0.012);
                    made.cube(stretch, axisColor(i), to, 0.06);
                }
            break;
        case M::kTransformBox:
            made.box(Assembly::Edges::kTurn);
            made.corners(false, HandleColor::kWhite, 0.06);
            break;
        case M::kPointLight:
            made.ball(made.add(HandleDeed::kMoveFacing), HandleColor::kWhite, Vec3d::Zero(), 0.2);
            made.moves();
            break;
        case M::kDirectionalLight: {
            made.cube(made.add(HandleDeed::kMoveFacing), HandleColor::kWhite, Vec3d::Zero(), 0.15);
            made.arrow(made.add(HandleDeed::kTurnBall), HandleColor::kGreen, -Vec3d::UnitZ(), 1.5);
            break;
        }
        case M::kSpotLight: {
            made.ball(made.add(HandleDeed::kMoveFacing), HandleColor::kWhite, Vec3d::Zero(), 0.15);
            made.arrow(made.add(HandleDeed::kTurnBall), HandleColor::kGreen, -Vec3d::UnitZ(), 1.5);
            const double angle = std::clamp(outerAngle, 0.02, std::numbers::pi / 2);
            made.piece(made.add(HandleDeed::kOpenCone), HandleShape::kRing, HandleColor::kRed,
                       Vec3d(-s * std::cos(angle) * Vec3d::UnitZ()), Quatd::Identity(),
                       Vec3d(s * std::sin(angle), s * std::sin(angle), s));
            break;
        }
        default:
            break;
    }
    return made.take();
}

}  // namespace tessera
