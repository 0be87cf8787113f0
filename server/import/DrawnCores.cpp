#include "server/import/DrawnCores.h"

#include <fmt/format.h>

#include <type_traits>
#include <utility>
#include <vector>

#include "common/cores/Geometry.h"
#include "common/cores/Text.h"
#include "common/drawable/Drawable.h"
#include "server/import/DeformedCores.h"
#include "server/import/NurbsCores.h"
#include "server/import/SurfaceCores.h"
#include "server/import/TableCores.h"

namespace tessera {
namespace {

/// Of all surfaces of an import: so many of any file, and more of a large one, whose letters cost bytes, too.
constexpr std::uint64_t kFreeDerivedTriangles = 10'000'000, kMostDerivedTriangles = 40'000'000,
                        kDerivedTrianglesPerByte = 20;

// One number in code, on the wire and in files.
using MeshMessage = proto::scene::Mesh;
static_assert(MeshMessage::TRIANGLES == Geometry::kTriangles && MeshMessage::POINTS == Geometry::kPoints &&
              MeshMessage::LINES == Geometry::kLines && MeshMessage::LINE_STRIPS == Geometry::kLineStrip &&
              MeshMessage::LINE_LOOPS == Geometry::kLineLoop && MeshMessage::QUADS == Geometry::kQuads &&
              MeshMessage::TRIANGLE_STRIPS == Geometry::kTriangleStrip &&
              MeshMessage::TRIANGLE_FANS == Geometry::kTriangleFan &&
              MeshMessage::QUAD_STRIPS == Geometry::kQuadStrip && MeshMessage::POLYGONS == Geometry::kPolygons);

}  // namespace

ObjectId DrawnCores::counted(const Core& core) {
    draft_.countDrawn(core.triangles);
    return core.id;
}

Expected<ObjectId> DrawnCores::geometry(LoadedFile& file, const proto::scene::Geometry& message, const Coating& paint) {
    Core& core = geometries_[{&file, message.mesh(), paint.nameFor(message.material()), paint.over}];
    if (core.id) return counted(core);
    Expected<Geometry> value = file.mesh(message.mesh());
    if (!value) return tl::unexpected(value.error());
    core.triangles = drawableOf(Object::of(*value)).triangleCount();
    const Expected<ObjectId> material = materials_.worn(file, message.material(), paint);
    if (!material) return material;
    value->material = *material;
    core.id = draft_.create(*value);
    draft_.countDrawable(core.triangles);
    return counted(core);
}

template <typename Surface>
Expected<DrawnCores::Core> DrawnCores::derived(LoadedFile& file, Surface surface, const std::string& said,
                                               const Coating& paint) {
    const Expected<ObjectId> material = materials_.worn(file, said, paint);
    if (!material) return tl::unexpected(material.error());
    surface.material = *material;
    const Drawable drawable = drawableOf(Object::of(surface));
    if (Expected<void> sound = drawable.check(); !sound) return tl::unexpected(sound.error());
    // Each surface is bounded; a file of thousands of them is too. Glyphs are never made into triangles.
    const std::uint64_t triangles = drawable.triangleCount();
    if (!std::is_same_v<Surface, Glyphs>) derivedTriangles_ += triangles;
    mostDerivedTriangles_ =
        std::max(mostDerivedTriangles_,
                 std::min(kMostDerivedTriangles, kFreeDerivedTriangles + file.bytes * kDerivedTrianglesPerByte));
    if (derivedTriangles_ > mostDerivedTriangles_)
        return fail(ErrorCode::kLimit, fmt::format("what the scene makes of few numbers (surfaces by control points, "
                                                   "text, particles, skins) has more than {} triangles: a lower level "
                                                   "or a larger tolerance has fewer",
                                                   mostDerivedTriangles_));
    const Core core{draft_.create(surface), triangles};
    draft_.countDrawable(triangles);
    return core;
}

template <typename Message, typename Read>
Expected<DrawnCores::Core> DrawnCores::shared(LoadedFile& file, const Message& message, const Coating& paint,
                                              Read read) {
    // Messages of two kinds may be the same bytes.
    const Hash128 said = hash128(asBytes(Message::descriptor()->full_name() + message.SerializeAsString()));
    Core& known = surfaces_[{&file, said, paint.nameFor(message.material()), paint.over}];
    if (known.id) return known;
    auto surface = read(message);
    if (!surface) return tl::unexpected(surface.error());
    Expected<Core> made = derived(file, std::move(*surface), message.material(), paint);
    if (made) known = *made;
    return made;
}

Expected<ObjectId> DrawnCores::deformation(LoadedFile& file, const proto::scene::Node& node, const Coating& paint) {
    Expected<Deformation> value = readDeformation(file, node);
    if (!value) return tl::unexpected(value.error());
    return derived(file, std::move(*value), node.geometry().material(), paint).map([&](const Core& core) {
        return counted(core);
    });
}

Expected<ObjectId> DrawnCores::skin(LoadedFile& file, const proto::scene::Skin& message, const Coating& paint) {
    Expected<Skin> value = readSkin(file, message);
    if (!value) return tl::unexpected(value.error());
    return derived(file, std::move(*value), message.material(), paint).map([&](const Core& core) {
        return counted(core);
    });
}

Expected<ObjectId> DrawnCores::surface(LoadedFile& file, const proto::scene::Node& node, const Coating& paint) {
    const Expected<Core> core = node.has_nurbs_surface()
                                    ? shared(file, node.nurbs_surface(), paint, &readNurbsSurface)
                                    : shared(file, node.subdivision_surface(), paint, &readSubdivisionSurface);
    if (!core) return tl::unexpected(core.error());
    if (core->triangles == 0)
        draft_.note(fmt::format("{}: nothing of the surface '{}' has an area that can be shown", file.label,
                                readName(node.name(), "")));
    return counted(*core);
}

Expected<ObjectId> DrawnCores::text(LoadedFile& file, const proto::scene::Text& message, const Coating& paint) {
    const auto read = [&](const proto::scene::Text& said) -> Expected<Text> {
        Expected<Text> text = readTableObject<Text>(said);
        if (!text) return text;
        std::vector<std::string> notes;
        const Expected<TextOutlines> outlines = typesetter_.set(*text, notes);
        for (const std::string& note : notes) draft_.note(fmt::format("{}: {}", file.label, note));
        if (outlines)
            text->outlines = outlines->toBlob();
        else if (outlines.error().code == ErrorCode::kUnsupported)
            // A machine without fonts may still hand the scene on.
            draft_.note(fmt::format("{}: {}", file.label, outlines.error().message));
        else
            return tl::unexpected(outlines.error());
        return text;
    };
    return shared(file, message, paint, read).map([&](const Core& core) { return counted(core); });
}

Expected<ObjectId> DrawnCores::particles(LoadedFile& file, const proto::scene::Particles& message,
                                         const Coating& paint) {
    return shared(file, message, paint, &readParticles).map([&](const Core& core) { return counted(core); });
}

Expected<ObjectId> DrawnCores::glyphs(LoadedFile& file, const proto::scene::Glyphs& message, const Coating& paint) {
    return shared(file, message, paint, &readGlyphs).map([&](const Core& core) { return counted(core); });
}

Expected<ObjectId> DrawnCores::volume(LoadedFile& file, const proto::scene::Volume& message, const Coating& paint) {
    const auto read = [&](const proto::scene::Volume& said) { return readVolume(file, said); };
    return shared(file, message, paint, read).map([&](const Core& core) { return counted(core); });
}

}  // namespace tessera
