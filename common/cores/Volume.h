/// A scalar field in a box of voxels.
#pragma once

#include "common/cores/ShippedTypes.h"
#include "common/field/Field.h"

namespace tessera {

/// What OpenSG has as DVRVolume and Slices. Values lie at the voxels' middles and are linear in between; outside of the
/// outermost middles there is nothing. Collisions and picks see the surface where the value is `surfaceValue`, in every
/// mode, as far as clip planes leave it. Colours are blended as they are encoded (sRGB), as all that is transparent. A
/// ray begins at the near plane.
struct Volume {
    static constexpr ObjectType kType{31};
    static constexpr std::int64_t kUint8 = 0, kUint16 = 1, kInt16 = 2, kFloat = 3;
    static constexpr std::int64_t kCloud = 0, kMaximum = 1, kSurface = 2, kSlices = 3;
    Blob voxels;  ///< one number each, little-endian, x first, then y, then z
    std::int64_t format = kUint8;
    std::int64_t sizeX = 0, sizeY = 0, sizeZ = 0;  ///< voxels
    Vec3d origin = Vec3d::Zero();                  ///< of the first voxel's middle, in the node's coordinates
    Vec3d spacing = Vec3d::Ones();                 ///< from middle to middle
    /// The transfer function: uint8[4] per stop, sRGB + opacity, evenly spaced from `low` to `high`, linear in between,
    /// the outermost beyond. Empty: grey, from nothing to opaque. What is opaque lets 2^-16 of the light through after
    /// `thickness`.
    Blob transfer;
    double low = 0, high = 255;  ///< values
    double thickness = 1;  ///< after so much of the node's coordinates an opacity of the transfer function is reached
    std::int64_t mode = kCloud;  ///< kCloud: light that is emitted and absorbed, front to back. kMaximum: of each ray
                                 ///< the greatest value
    double surfaceValue = 127;
    /// Of kSlices: double[4] per plane, n·x = d in the node's coordinates: what lies on it, as the transfer function
    /// colours it, unlit.
    Blob slices;
    Blob clipPlanes;     ///< double[4] per plane: where n·x > d holds there is nothing, in every mode
    double step = 0.5;   ///< of a ray, of the smallest spacing; a ray takes at most 4,096
    bool shaded = true;  ///< clouds: lit by the scene's lights, with the field's gradient as normal
    ObjectId material;   ///< of the surface
};
template <>
inline constexpr auto kSaid<Volume> = []<typename T>(Describing<T>) {
    return describe(
        "Volume", field<&T::voxels>(1, "voxels").affects(Effect::kShape),
        field<&T::format>(2, "format")
            .oneOf({{Volume::kUint8, "uint8"},
                    {Volume::kUint16, "uint16"},
                    {Volume::kInt16, "int16"},
                    {Volume::kFloat, "float"}})
            .affects(Effect::kShape),
        field<&T::sizeX>(3, "sizeX").between(0, 4096).affects(Effect::kShape),
        field<&T::sizeY>(4, "sizeY").between(0, 4096).affects(Effect::kShape),
        field<&T::sizeZ>(5, "sizeZ").between(0, 4096).affects(Effect::kShape),
        field<&T::origin>(6, "origin").unit(Unit::kWorld).between(-1e30, 1e30).affects(Effect::kShape),
        field<&T::spacing>(7, "spacing").unit(Unit::kWorld).between(1e-30, 1e30).affects(Effect::kShape),
        field<&T::transfer>(8, "transfer").affects(Effect::kLook),
        field<&T::low>(9, "low").between(-1e30, 1e30).affects(Effect::kLook),
        field<&T::high>(10, "high").between(-1e30, 1e30).affects(Effect::kLook),
        field<&T::thickness>(11, "thickness").unit(Unit::kWorld).between(1e-30, 1e30).affects(Effect::kLook),
        field<&T::mode>(12, "mode")
            .oneOf({{Volume::kCloud, "cloud"},
                    {Volume::kMaximum, "maximum"},
                    {Volume::kSurface, "surface"},
                    {Volume::kSlices, "slices"}})
            .affects(Effect::kShape),
        field<&T::surfaceValue>(13, "surfaceValue").between(-1e30, 1e30).affects(Effect::kShape),
        field<&T::slices>(14, "slices").doublesEach(4).affects(Effect::kLook),
        field<&T::clipPlanes>(15, "clipPlanes").doublesEach(4).affects(Effect::kShape),
        field<&T::step>(16, "step").between(0.05, 4).affects(Effect::kLook),
        field<&T::shaded>(17, "shaded").affects(Effect::kLook),
        field<&T::material>(18, "material").to(typeOf<Material>()).affects(Effect::kLook));
};

}  // namespace tessera
