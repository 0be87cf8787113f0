/// The cores: what a node can hold. Plain structs; the field table gives their fields ids and names.
///
/// Default values are the values of a freshly created core. Colours are linear RGB unless a comment says otherwise.
#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "common/change/Value.h"
#include "common/math/Types.h"

namespace tessera {

/// Object types and their numbers on the wire and in files. Numbers are never reused.
enum class TypeNumber : std::uint16_t {
    kNode = 1,
    kGroup = 2,
    kTransform = 3,
    kGeometry = 4,
    kMaterial = 5,
    kImage = 6,
    kSwitch = 7,
    kDirectionalLight = 8,
    kPointLight = 9,
    kCamera = 10,
    kMotion = 11,
    kEnvironment = 12,
    kInterest = 13,
    kCollisionObject = 14,
};

/// Nothing but children.
struct Group {
    static constexpr TypeNumber kType = TypeNumber::kGroup;
};

/// parent_T_node = translation · rotation · scale.
struct Transform {
    static constexpr TypeNumber kType = TypeNumber::kTransform;
    Vec3d translation = Vec3d::Zero();
    Quatd rotation = Quatd::Identity();  ///< stored w x y z; normalised on use, never zero
    Vec3d scale = Vec3d::Ones();
};

/// Indexed triangles. All arrays are blobs; optional ones may be empty. `common/geometry/Mesh.h` checks and views them.
struct Geometry {
    static constexpr TypeNumber kType = TypeNumber::kGeometry;
    Blob positions;     ///< float[3] per vertex
    Blob normals;       ///< float[3] per vertex, unit length; empty: faceted
    Blob colors;        ///< uint8[4] per vertex, sRGB + alpha, multiplied with the material; empty: white
    Blob texcoords;     ///< float[2] per vertex, origin at the image's upper left as in glTF; empty: none
    Blob indices;       ///< uint32[3] per triangle, counter-clockwise seen from outside
    ObjectId material;  ///< a Material; none: the default material
};

/// Metal-roughness shading as glTF 2.0 defines it.
struct Material {
    static constexpr TypeNumber kType = TypeNumber::kMaterial;
    Vec4f baseColor{0.8f, 0.8f, 0.8f, 1.0f};  ///< alpha below 1: drawn as transparent
    float metallic = 0.0f;
    float roughness = 0.6f;
    Vec3f emissive = Vec3f::Zero();
    ObjectId baseColorImage;  ///< an Image (sRGB); none: white
    std::int64_t doubleSided = 0;
};

struct Image {
    static constexpr TypeNumber kType = TypeNumber::kImage;
    Blob pixels;  ///< uint8[4] RGBA per pixel, sRGB, rows from the top
    std::int64_t widthPx = 0;
    std::int64_t heightPx = 0;
};

/// Shows one child, all or none.
struct Switch {
    static constexpr TypeNumber kType = TypeNumber::kSwitch;
    static constexpr std::int64_t kAll = -1;
    static constexpr std::int64_t kNone = -2;
    std::int64_t choice = kAll;  ///< index of the child shown; an index past the end shows none
};

/// Shines along -Z of its node.
struct DirectionalLight {
    static constexpr TypeNumber kType = TypeNumber::kDirectionalLight;
    Vec3f color = Vec3f::Ones();
    float intensity = 1.0f;
};

/// Sits at the origin of its node.
struct PointLight {
    static constexpr TypeNumber kType = TypeNumber::kPointLight;
    Vec3f color = Vec3f::Ones();
    float intensity = 1.0f;  ///< falls with the square of the distance in world units
    float range = 0.0f;      ///< world units; no effect beyond. 0: unlimited
};

/// Places the wall in the world: the node's pose is the pose of the wall's coordinate system, `worldUnitsPerMetre` its
/// scale. Frusta come from screens and eyes alone. The first enabled camera in document order is the one in use.
struct Camera {
    static constexpr TypeNumber kType = TypeNumber::kCamera;
    double worldUnitsPerMetre = 1.0;
    std::int64_t enabled = 1;
};

/// Key-framed motion of a Transform. Evaluated on the server only; its results travel as values.
struct Motion {
    static constexpr TypeNumber kType = TypeNumber::kMotion;
    static constexpr std::int64_t kOnce = 0, kLoop = 1, kPingPong = 2;
    ObjectId target;  ///< a Transform
    /// double[11] per key: time in s (ascending), translation xyz, rotation wxyz, scale xyz. Linear between keys,
    /// rotation by slerp along the shorter arc.
    Blob keys;
    std::int64_t mode = kOnce;
    std::int64_t playing = 1;
    /// Local time in s: grows by 1/60 s per frame while the motion plays and nothing stops its target.
    double time = 0.0;
};

/// Light from everywhere, and what is seen where nothing is. The first one in document order is used.
struct Environment {
    static constexpr TypeNumber kType = TypeNumber::kEnvironment;
    Vec3f sky{0.30f, 0.33f, 0.38f};         ///< ambient radiance from +Y
    Vec3f ground{0.12f, 0.11f, 0.10f};      ///< ambient radiance from -Y
    Vec3f background{0.05f, 0.06f, 0.08f};  ///< linear colour of empty pixels
    Vec3d gravity = Vec3d::Zero();          ///< acceleration of free bodies, world units per s²
};

/// What takes part in collisions as one object: `node` and all below it, but for what belongs to an object further down.
/// server/collision/README.md tells what becomes of it.
struct CollisionObject {
    static constexpr TypeNumber kType = TypeNumber::kCollisionObject;
    static constexpr std::int64_t kStatic = 0, kRigid = 1, kDeforming = 2;
    static constexpr std::int64_t kWhole = 0, kEachChild = 1, kEachGeometry = 2;
    static constexpr std::int64_t kTriangles = 0, kHull = 1;
    ObjectId node;  ///< none: the core means nothing
    /// Static: expected to stay; moved all the same, it jumps. Rigid: its motions are followed from frame to frame.
    /// Deforming: the arrays of its geometries may change in every frame.
    std::int64_t kind = kRigid;
    std::int64_t division = kWhole;   ///< a group: each child of the node, or each geometry below it, is an object by itself
    std::int64_t shape = kTriangles;  ///< the surface as it is, or the convex hull of each geometry, which is solid
    std::int64_t layers = 1;          ///< bits for the masks of interests; 0: takes part in nothing
    /// Above 0, for rigid objects that are whole and whose node is a Transform of its own: a free body, which gravity,
    /// impulses and its velocities move. 0: moved by motions and hands alone, and by no impulse.
    double mass = 0;
    double restitution = 0.2;         ///< 0 to 1; of two bodies the greater counts
    double friction = 0.5;            ///< Coulomb's; of two bodies the geometric mean counts
    Vec3d velocity = Vec3d::Zero();   ///< of a free body's centre of mass; world units per s
    Vec3d spin = Vec3d::Zero();       ///< of a free body; world axes, radians per s
};

/// An application's interest in collisions: the objects of one side against those of the other.
///
/// A side is a node: the CollisionObjects at or below it that share a bit with the side's mask. Where there are none,
/// `object` means the node and all below it as one object; `against` (none: the root) takes in all other geometry below
/// it besides, each for itself, as layer 1. What belongs to one object never meets itself.
struct Interest {
    static constexpr TypeNumber kType = TypeNumber::kInterest;
    static constexpr std::int64_t kReport = 0, kStop = 1, kSlide = 2, kBounce = 3, kRollback = 4, kAsk = 5;
    static constexpr std::int64_t kPseudoDynamic = 0, kStatic = 1, kDynamic = 2, kDistance = 3, kIgnore = 4;
    static constexpr std::int64_t kAllFaces = 0, kYesOrNo = -1;
    static constexpr std::int64_t kShowPoints = 1, kShowNormals = 2, kShowFaces = 4;
    ObjectId object;   ///< a node; none: the interest means nothing
    ObjectId against;  ///< a node; none: the root
    /// To a motion that would lead into something. Of several interests in one pair of objects the first in document order
    /// decides.
    std::int64_t response = kStop;
    std::int64_t enabled = 1;
    /// kStatic: what meets. kPseudoDynamic: that, and what began and ended. kDynamic: that, and the first time of contact
    /// within each frame's motion. kDistance: how far apart. kIgnore: its pairs are of no interest to anybody.
    std::int64_t mode = kPseudoDynamic;
    std::int64_t detail = kAllFaces;  ///< pairs of faces listed per pair of objects: all, so many, or whether they meet
    std::int64_t objectLayers = -1, againstLayers = -1;  ///< masks: bits of CollisionObject::layers
    double threshold = 0;                                ///< of kDistance: nearer than this is near; world units
    std::int64_t show = 0;                               ///< bits: what of its contacts is drawn on the wall
    std::int64_t patience = 12;  ///< of kAsk: frames until the question goes unanswered
};

/// A place in the tree. One node, one path; several nodes may share one core.
struct Node {
    static constexpr TypeNumber kType = TypeNumber::kNode;
    std::string name;
    ObjectId core;  ///< none: an empty group
    // Structure: changed by placements only.
    ObjectId parent;
    std::vector<ObjectId> children;
};

using Object = std::variant<Node, Group, Transform, Geometry, Material, Image, Switch, DirectionalLight, PointLight,
                            Camera, Motion, Environment, Interest, CollisionObject>;

[[nodiscard]] constexpr ObjectType objectType(TypeNumber number) {
    return ObjectType{static_cast<std::uint16_t>(number)};
}
template <typename Core>
[[nodiscard]] constexpr ObjectType typeOf() {
    return objectType(Core::kType);
}
[[nodiscard]] ObjectType typeOf(const Object& object);

}  // namespace tessera
