/// The one table of object types and fields. Codec, snapshot, inspector, text format and hash see only fields and
/// values.
#pragma once

#include <limits>
#include <optional>
#include <span>
#include <string_view>

#include "common/base/Error.h"
#include "common/scene/Cores.h"

namespace tessera {

struct FieldInfo {
    FieldId id;             ///< unique within its type; never reused
    std::string_view name;  ///< e.g. "translation"
    FieldKind kind;
    std::uint8_t width;
    /// For refs: what may be referred to (none: any core for Node.core). Refs may always be "none".
    std::optional<ObjectType> refType;
    bool quaternion = false;  ///< width 4, must not be zero
    FieldValue (*load)(const Object&);
    void (*store)(Object&, const FieldValue&);  ///< kind and width already checked
    /// Where the value lies in an object of this type: `width` floats or doubles, one std::int64_t, ObjectId,
    /// std::string or Blob. Quaternions lie there as x y z w, while values say w x y z.
    void* (*at)(Object&);
    /// What a number of this field may be (each scalar of it). Every number must be finite besides.
    double least = -std::numeric_limits<double>::infinity();
    double greatest = std::numeric_limits<double>::infinity();
};

/// The field's value where it lies; T is the C++ type of its kind (see FieldInfo::at).
template <typename T>
[[nodiscard]] T* fieldAt(const FieldInfo& field, Object& object) {
    return static_cast<T*>(field.at(object));
}
template <typename T>
[[nodiscard]] const T* fieldAt(const FieldInfo& field, const Object& object) {
    return static_cast<const T*>(field.at(const_cast<Object&>(object)));
}

struct TypeInfo {
    ObjectType type;
    std::string_view name;  ///< e.g. "Transform"
    bool isCore;            ///< may be a node's core (Material and Image may not)
    std::span<const FieldInfo> fields;
    Object (*make)();  ///< a fresh object of this type
};

[[nodiscard]] std::span<const TypeInfo> allTypes();
/// Null where the number or name is unknown.
[[nodiscard]] const TypeInfo* findType(ObjectType type);
[[nodiscard]] const TypeInfo* findType(std::string_view name);
/// The entry of an object that is there.
[[nodiscard]] const TypeInfo& typeInfo(const Object& object);
[[nodiscard]] const FieldInfo* findField(const TypeInfo& type, FieldId field);
[[nodiscard]] const FieldInfo* findField(const TypeInfo& type, std::string_view name);

/// Hash over numbers, names, kinds and widths of all types and fields. Two programs with different hashes do not
/// understand each other's change lists.
[[nodiscard]] std::uint64_t schemaHash();

/// Field ids by name for code that sets fields: `field::kTranslation` and so on.
namespace field {
inline constexpr FieldId kNodeName{1}, kNodeCore{2};
inline constexpr FieldId kTranslation{1}, kRotation{2}, kScale{3};
inline constexpr FieldId kPositions{1}, kNormals{2}, kColors{3}, kTexcoords{4}, kIndices{5}, kGeometryMaterial{6};
inline constexpr FieldId kBaseColor{1}, kMetallic{2}, kRoughness{3}, kEmissive{4}, kBaseColorImage{5}, kDoubleSided{6};
inline constexpr FieldId kPixels{1}, kImageWidth{2}, kImageHeight{3};
inline constexpr FieldId kChoice{1};
inline constexpr FieldId kLightColor{1}, kLightIntensity{2}, kLightRange{3};
inline constexpr FieldId kWorldUnitsPerMetre{1}, kCameraEnabled{2};
inline constexpr FieldId kMotionTarget{1}, kMotionKeys{2}, kMotionMode{3}, kMotionPlaying{4}, kMotionTime{5};
inline constexpr FieldId kSky{1}, kGround{2}, kBackground{3}, kGravity{4};
inline constexpr FieldId kInterestObject{1}, kInterestAgainst{2}, kInterestResponse{3}, kInterestEnabled{4};
inline constexpr FieldId kInterestMode{5}, kInterestDetail{6}, kInterestObjectLayers{7}, kInterestAgainstLayers{8},
    kInterestThreshold{9}, kInterestShow{10}, kInterestPatience{11};
inline constexpr FieldId kCollisionNode{1}, kCollisionKind{2}, kCollisionDivision{3}, kCollisionShape{4}, kCollisionLayers{5},
    kMass{6}, kRestitution{7}, kFriction{8}, kVelocity{9}, kSpin{10};
}  // namespace field

/// Conversions between C++ values and FieldValue.
[[nodiscard]] FieldValue toValue(float v);
[[nodiscard]] FieldValue toValue(double v);
[[nodiscard]] FieldValue toValue(const Vec3f& v);
[[nodiscard]] FieldValue toValue(const Vec4f& v);
[[nodiscard]] FieldValue toValue(const Vec3d& v);
[[nodiscard]] FieldValue toValue(const Quatd& q);
[[nodiscard]] inline FieldValue toValue(std::int64_t v) {
    return v;
}
[[nodiscard]] inline FieldValue toValue(ObjectId v) {
    return v;
}
[[nodiscard]] inline FieldValue toValue(std::string v) {
    return v;
}
[[nodiscard]] inline FieldValue toValue(Blob v) {
    return v;
}

}  // namespace tessera
