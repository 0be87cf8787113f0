#include "common/scene/FieldTable.h"

#include <algorithm>

namespace tessera {

namespace {

// ---- C++ type <-> kind, width and FieldValue -----------------------------------------------------------------------

template <typename T>
struct Shape;
template <>
struct Shape<float> {
    static constexpr FieldKind kKind = FieldKind::kFloat;
    static constexpr std::uint8_t kWidth = 1;
    static void assign(float& to, const FieldValue& value) { to = std::get<Floats>(value).values[0]; }
    static void* at(float& v) { return &v; }
};
template <>
struct Shape<double> {
    static constexpr FieldKind kKind = FieldKind::kDouble;
    static constexpr std::uint8_t kWidth = 1;
    static void assign(double& to, const FieldValue& value) { to = std::get<Doubles>(value).values[0]; }
    static void* at(double& v) { return &v; }
};
template <int N>
struct Shape<Eigen::Matrix<float, N, 1>> {
    static constexpr FieldKind kKind = FieldKind::kFloat;
    static constexpr std::uint8_t kWidth = N;
    static void assign(Eigen::Matrix<float, N, 1>& to, const FieldValue& value) {
        std::copy_n(std::get<Floats>(value).values.begin(), N, to.data());
    }
    static void* at(Eigen::Matrix<float, N, 1>& v) { return v.data(); }
};
template <>
struct Shape<Vec3d> {
    static constexpr FieldKind kKind = FieldKind::kDouble;
    static constexpr std::uint8_t kWidth = 3;
    static void assign(Vec3d& to, const FieldValue& value) {
        std::copy_n(std::get<Doubles>(value).values.begin(), 3, to.data());
    }
    static void* at(Vec3d& v) { return v.data(); }
};
template <>
struct Shape<Quatd> {
    static constexpr FieldKind kKind = FieldKind::kDouble;
    static constexpr std::uint8_t kWidth = 4;
    static void assign(Quatd& to, const FieldValue& value) {
        const auto& wxyz = std::get<Doubles>(value).values;
        to = Quatd(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
    }
    static void* at(Quatd& v) { return v.coeffs().data(); }
};
template <typename T, FieldKind kind>
struct SingleShape {
    static constexpr FieldKind kKind = kind;
    static constexpr std::uint8_t kWidth = 1;
    static void assign(T& to, const FieldValue& value) { to = std::get<T>(value); }
    static void* at(T& v) { return &v; }
};
template <>
struct Shape<std::int64_t> : SingleShape<std::int64_t, FieldKind::kInt> {};
template <>
struct Shape<ObjectId> : SingleShape<ObjectId, FieldKind::kRef> {};
template <>
struct Shape<std::string> : SingleShape<std::string, FieldKind::kText> {};
template <>
struct Shape<Blob> : SingleShape<Blob, FieldKind::kBlob> {};

template <typename Member>
struct MemberOf;
template <typename Core_, typename Type_>
struct MemberOf<Type_ Core_::*> {
    using Core = Core_;
    using Type = Type_;
};

// ---- the table -----------------------------------------------------------------------------------------------------

template <auto kMember>
constexpr FieldInfo fieldOf(FieldId id, std::string_view name) {
    using Core = typename MemberOf<decltype(kMember)>::Core;
    using Type = typename MemberOf<decltype(kMember)>::Type;
    return {
        .id = id,
        .name = name,
        .kind = Shape<Type>::kKind,
        .width = Shape<Type>::kWidth,
        .refType = std::nullopt,
        .quaternion = std::is_same_v<Type, Quatd>,
        .load = [](const Object& object) -> FieldValue { return toValue(std::get<Core>(object).*kMember); },
        .store = [](Object& object,
                    const FieldValue& value) { Shape<Type>::assign(std::get<Core>(object).*kMember, value); },
        .at = [](Object& object) -> void* { return Shape<Type>::at(std::get<Core>(object).*kMember); },
    };
}
template <auto kMember>
constexpr FieldInfo refOf(FieldId id, std::string_view name, TypeNumber to) {
    FieldInfo info = fieldOf<kMember>(id, name);
    info.refType = objectType(to);
    return info;
}
constexpr FieldInfo between(double least, double greatest, FieldInfo info) {
    info.least = least;
    info.greatest = greatest;
    return info;
}

// Bounds stand only where a value beyond them would break somebody who trusts the scene.
constexpr double kMaxImagePx = 65536;
constexpr double kLeastScale = 1e-9;
constexpr double kGreatestScale = 1e9;

constexpr FieldInfo kNodeFields[] = {
    fieldOf<&Node::name>(field::kNodeName, "name"),
    fieldOf<&Node::core>(field::kNodeCore, "core"),
};
constexpr FieldInfo kTransformFields[] = {
    fieldOf<&Transform::translation>(field::kTranslation, "translation"),
    fieldOf<&Transform::rotation>(field::kRotation, "rotation"),
    fieldOf<&Transform::scale>(field::kScale, "scale"),
};
constexpr FieldInfo kGeometryFields[] = {
    fieldOf<&Geometry::positions>(field::kPositions, "positions"),
    fieldOf<&Geometry::normals>(field::kNormals, "normals"),
    fieldOf<&Geometry::colors>(field::kColors, "colors"),
    fieldOf<&Geometry::texcoords>(field::kTexcoords, "texcoords"),
    fieldOf<&Geometry::indices>(field::kIndices, "indices"),
    refOf<&Geometry::material>(field::kGeometryMaterial, "material", TypeNumber::kMaterial),
};
constexpr FieldInfo kMaterialFields[] = {
    fieldOf<&Material::baseColor>(field::kBaseColor, "baseColor"),
    fieldOf<&Material::metallic>(field::kMetallic, "metallic"),
    fieldOf<&Material::roughness>(field::kRoughness, "roughness"),
    fieldOf<&Material::emissive>(field::kEmissive, "emissive"),
    refOf<&Material::baseColorImage>(field::kBaseColorImage, "baseColorImage", TypeNumber::kImage),
    between(0, 1, fieldOf<&Material::doubleSided>(field::kDoubleSided, "doubleSided")),
};
constexpr FieldInfo kImageFields[] = {
    fieldOf<&Image::pixels>(field::kPixels, "pixels"),
    between(0, kMaxImagePx, fieldOf<&Image::widthPx>(field::kImageWidth, "widthPx")),
    between(0, kMaxImagePx, fieldOf<&Image::heightPx>(field::kImageHeight, "heightPx")),
};
constexpr FieldInfo kSwitchFields[] = {
    between(Switch::kNone, 1e9, fieldOf<&Switch::choice>(field::kChoice, "choice")),
};
constexpr FieldInfo kDirectionalLightFields[] = {
    fieldOf<&DirectionalLight::color>(field::kLightColor, "color"),
    fieldOf<&DirectionalLight::intensity>(field::kLightIntensity, "intensity"),
};
constexpr FieldInfo kPointLightFields[] = {
    fieldOf<&PointLight::color>(field::kLightColor, "color"),
    fieldOf<&PointLight::intensity>(field::kLightIntensity, "intensity"),
    fieldOf<&PointLight::range>(field::kLightRange, "range"),
};
constexpr FieldInfo kCameraFields[] = {
    between(kLeastScale, kGreatestScale,
            fieldOf<&Camera::worldUnitsPerMetre>(field::kWorldUnitsPerMetre, "worldUnitsPerMetre")),
    between(0, 1, fieldOf<&Camera::enabled>(field::kCameraEnabled, "enabled")),
};
constexpr FieldInfo kMotionFields[] = {
    refOf<&Motion::target>(field::kMotionTarget, "target", TypeNumber::kTransform),
    fieldOf<&Motion::keys>(field::kMotionKeys, "keys"),
    between(Motion::kOnce, Motion::kPingPong, fieldOf<&Motion::mode>(field::kMotionMode, "mode")),
    between(0, 1, fieldOf<&Motion::playing>(field::kMotionPlaying, "playing")),
    fieldOf<&Motion::time>(field::kMotionTime, "time"),
};
constexpr FieldInfo kEnvironmentFields[] = {
    fieldOf<&Environment::sky>(field::kSky, "sky"),
    fieldOf<&Environment::ground>(field::kGround, "ground"),
    fieldOf<&Environment::background>(field::kBackground, "background"),
    between(-1e6, 1e6, fieldOf<&Environment::gravity>(field::kGravity, "gravity")),
};
constexpr FieldInfo kInterestFields[] = {
    refOf<&Interest::object>(field::kInterestObject, "object", TypeNumber::kNode),
    refOf<&Interest::against>(field::kInterestAgainst, "against", TypeNumber::kNode),
    between(Interest::kReport, Interest::kAsk, fieldOf<&Interest::response>(field::kInterestResponse, "response")),
    between(0, 1, fieldOf<&Interest::enabled>(field::kInterestEnabled, "enabled")),
    between(Interest::kPseudoDynamic, Interest::kIgnore, fieldOf<&Interest::mode>(field::kInterestMode, "mode")),
    between(Interest::kYesOrNo, 1e6, fieldOf<&Interest::detail>(field::kInterestDetail, "detail")),
    fieldOf<&Interest::objectLayers>(field::kInterestObjectLayers, "objectLayers"),
    fieldOf<&Interest::againstLayers>(field::kInterestAgainstLayers, "againstLayers"),
    between(0, 1e12, fieldOf<&Interest::threshold>(field::kInterestThreshold, "threshold")),
    between(0, 7, fieldOf<&Interest::show>(field::kInterestShow, "show")),
    between(0, 1e6, fieldOf<&Interest::patience>(field::kInterestPatience, "patience")),
};
constexpr double kFastest = 1e6;
constexpr FieldInfo kCollisionObjectFields[] = {
    refOf<&CollisionObject::node>(field::kCollisionNode, "node", TypeNumber::kNode),
    between(CollisionObject::kStatic, CollisionObject::kDeforming,
            fieldOf<&CollisionObject::kind>(field::kCollisionKind, "kind")),
    between(CollisionObject::kWhole, CollisionObject::kEachGeometry,
            fieldOf<&CollisionObject::division>(field::kCollisionDivision, "division")),
    between(CollisionObject::kTriangles, CollisionObject::kHull,
            fieldOf<&CollisionObject::shape>(field::kCollisionShape, "shape")),
    fieldOf<&CollisionObject::layers>(field::kCollisionLayers, "layers"),
    between(0, 1e12, fieldOf<&CollisionObject::mass>(field::kMass, "mass")),
    between(0, 1, fieldOf<&CollisionObject::restitution>(field::kRestitution, "restitution")),
    between(0, 1e3, fieldOf<&CollisionObject::friction>(field::kFriction, "friction")),
    between(-kFastest, kFastest, fieldOf<&CollisionObject::velocity>(field::kVelocity, "velocity")),
    between(-kFastest, kFastest, fieldOf<&CollisionObject::spin>(field::kSpin, "spin")),
};

template <typename T>
constexpr TypeInfo typeEntry(std::string_view name, bool isCore, std::span<const FieldInfo> fields) {
    return {typeOf<T>(), name, isCore, fields, [] { return Object(T()); }};
}

constexpr TypeInfo kTypes[] = {
    typeEntry<Node>("Node", false, kNodeFields),
    typeEntry<Group>("Group", true, {}),
    typeEntry<Transform>("Transform", true, kTransformFields),
    typeEntry<Geometry>("Geometry", true, kGeometryFields),
    typeEntry<Material>("Material", false, kMaterialFields),
    typeEntry<Image>("Image", false, kImageFields),
    typeEntry<Switch>("Switch", true, kSwitchFields),
    typeEntry<DirectionalLight>("DirectionalLight", true, kDirectionalLightFields),
    typeEntry<PointLight>("PointLight", true, kPointLightFields),
    typeEntry<Camera>("Camera", true, kCameraFields),
    typeEntry<Motion>("Motion", true, kMotionFields),
    typeEntry<Environment>("Environment", true, kEnvironmentFields),
    typeEntry<Interest>("Interest", true, kInterestFields),
    typeEntry<CollisionObject>("CollisionObject", true, kCollisionObjectFields),
};

// The table stands in the order of the variant's alternatives, so that an object finds its entry by index.
template <std::size_t... kIndex>
constexpr bool tableFollowsVariant(std::index_sequence<kIndex...>) {
    return std::size(kTypes) == std::variant_size_v<Object> &&
           ((kTypes[kIndex].type == typeOf<std::variant_alternative_t<kIndex, Object>>()) && ...);
}
static_assert(tableFollowsVariant(std::make_index_sequence<std::variant_size_v<Object>>()));

template <typename Scalar, int N>
auto packed(const Eigen::Matrix<Scalar, N, 1>& v) {
    std::conditional_t<std::is_same_v<Scalar, float>, Floats, Doubles> values;
    std::copy_n(v.data(), N, values.values.begin());
    values.width = N;
    return values;
}

}  // namespace

std::span<const TypeInfo> allTypes() {
    return kTypes;
}

const TypeInfo* findType(ObjectType type) {
    const auto it =
        std::find_if(std::begin(kTypes), std::end(kTypes), [&](const TypeInfo& t) { return t.type == type; });
    return it == std::end(kTypes) ? nullptr : it;
}

const TypeInfo* findType(std::string_view name) {
    const auto it =
        std::find_if(std::begin(kTypes), std::end(kTypes), [&](const TypeInfo& t) { return t.name == name; });
    return it == std::end(kTypes) ? nullptr : it;
}

const TypeInfo& typeInfo(const Object& object) {
    return kTypes[object.index()];
}

ObjectType typeOf(const Object& object) {
    return typeInfo(object).type;
}

const FieldInfo* findField(const TypeInfo& type, FieldId id) {
    for (const FieldInfo& info : type.fields)
        if (info.id == id) return &info;
    return nullptr;
}

const FieldInfo* findField(const TypeInfo& type, std::string_view name) {
    for (const FieldInfo& info : type.fields)
        if (info.name == name) return &info;
    return nullptr;
}

std::uint64_t schemaHash() {
    std::string text;
    const auto say = [&](std::string_view word) { text.append(word).push_back('\n'); };
    for (const TypeInfo& type : kTypes) {
        say(type.name);
        say(std::to_string(type.type.value));
        for (const FieldInfo& info : type.fields) {
            say(info.name);
            say(std::to_string(info.id.value) + ' ' + std::to_string(static_cast<int>(info.kind)) + ' ' +
                std::to_string(info.width) + ' ' + std::to_string(info.refType.value_or(ObjectType()).value));
        }
    }
    return hash64(asBytes(text));
}

FieldValue toValue(float v) {
    return Floats{{v}, 1};
}
FieldValue toValue(double v) {
    return Doubles{{v}, 1};
}
FieldValue toValue(const Vec3f& v) {
    return packed<float, 3>(v);
}
FieldValue toValue(const Vec4f& v) {
    return packed<float, 4>(v);
}
FieldValue toValue(const Vec3d& v) {
    return packed<double, 3>(v);
}
FieldValue toValue(const Quatd& q) {
    return Doubles{{q.w(), q.x(), q.y(), q.z()}, 4};
}

}  // namespace tessera
