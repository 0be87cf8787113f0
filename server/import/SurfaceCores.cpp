#include "server/import/SurfaceCores.h"

#include <utility>
#include <vector>

#include "server/import/MessageArrays.h"
#include "server/import/TableCores.h"

namespace tessera {

Expected<SubdivisionSurface> readSubdivisionSurface(const proto::scene::SubdivisionSurface& message) {
    Expected<SubdivisionSurface> surface = readTableObject<SubdivisionSurface>(message);
    if (!surface) return surface;
    surface->points = blobOfNumbers(message.points());
    surface->faceVertices = blobOfNumbers(message.face_vertices());
    surface->faceSizes = blobOfNumbers(message.face_sizes());
    if (message.face_sizes().empty()) {
        const std::uint32_t each = surface->scheme == SubdivisionSurface::kLoop ? 3 : 4;
        surface->faceSizes = blobOfNumbers(
            std::vector<std::uint32_t>(static_cast<std::size_t>(message.face_vertices_size()) / each, each));
    }
    surface->creases = blobOfNumbers(message.creases());
    surface->creaseSharpness = blobOfNumbers(message.crease_sharpness());
    surface->corners = blobOfNumbers(message.corners());
    surface->cornerSharpness = blobOfNumbers(message.corner_sharpness());
    surface->holes = blobOfNumbers(message.holes());
    return surface;
}

Expected<Particles> readParticles(const proto::scene::Particles& message) {
    if (!proto::scene::Particles::Mode_IsValid(message.mode()))
        return fail(ErrorCode::kBadInput, "the particles' mode is none of its words");
    Expected<Particles> particles = readTableObject<Particles>(message);
    if (!particles) return particles;
    particles->positions = blobOfNumbers(message.positions());
    particles->tails = blobOfNumbers(message.tails());
    particles->colors = blobOfColors(message.colors());
    particles->sizes = blobOfNumbers(message.sizes());
    particles->ages = blobOfNumbers(message.ages());
    particles->turns = blobOfNumbers(message.turns());
    particles->ageColors = blobOfColors(message.age_colors());
    particles->ageSizes = blobOfNumbers(message.age_sizes());
    return particles;
}

Expected<Glyphs> readGlyphs(const proto::scene::Glyphs& message) {
    using Message = proto::scene::Glyphs;
    const bool known = Message::Shape_IsValid(message.shape()) && Message::By_IsValid(message.length_by()) &&
                       Message::By_IsValid(message.width_by()) && Message::By_IsValid(message.color_by());
    if (!known) return fail(ErrorCode::kBadInput, "the glyphs' shape, or what they follow, is none of its words");
    Expected<Glyphs> glyphs = readTableObject<Glyphs>(message);
    if (!glyphs) return glyphs;
    glyphs->positions = blobOfNumbers(message.positions());
    glyphs->vectors = blobOfNumbers(message.vectors());
    glyphs->scalars = blobOfNumbers(message.scalars());
    glyphs->colors = blobOfColors(message.colors());
    glyphs->shapePositions = blobOfNumbers(message.shape_positions());
    glyphs->shapeNormals = blobOfNumbers(message.shape_normals());
    glyphs->shapeIndices = blobOfNumbers(message.shape_indices());
    glyphs->transfer = blobOfColors(message.transfer());
    glyphs->turns = blobOfNumbers(message.turns());
    glyphs->shapeTexcoords = blobOfNumbers(message.shape_texcoords());
    return glyphs;
}

Expected<Volume> readVolume(const LoadedFile& file, const proto::scene::Volume& message) {
    using Message = proto::scene::Volume;
    if (!Message::Mode_IsValid(message.mode()) || !Message::Format_IsValid(message.format()))
        return fail(ErrorCode::kBadInput, "the volume's mode or format is none of its words");
    Expected<Volume> volume = readTableObject<Volume>(message);
    if (!volume) return volume;
    if (message.voxels_blob() != 0) {
        Expected<Blob> voxels = file.blob(message.voxels_blob());
        if (!voxels) return tl::unexpected(voxels.error());
        volume->voxels = std::move(*voxels);
    } else {
        volume->voxels = blobOfNumbers(message.voxels());
        volume->format = Volume::kFloat;
    }
    volume->transfer = blobOfColors(message.transfer());
    volume->slices = blobOfNumbers(message.slices());
    volume->clipPlanes = blobOfNumbers(message.clip_planes());
    return volume;
}

}  // namespace tessera
