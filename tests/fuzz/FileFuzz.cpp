/// What our own code reads in the confined child: glTF, Tessera's scenes, meshes (OBJ, STL, PLY), meshes in text,
/// images. (What assimp reads is assimp's, which is why there is a child.)
#include <cstring>
#include <string>
#include <utility>

#include "server/import/reader/ImageDecoder.h"
#include "server/import/reader/ReadScene.h"
#include "tests/fuzz/FuzzInput.h"
#include "tests/fuzz/ScratchFile.h"

namespace tessera::fuzz {
namespace {

/// Or refused in words: what is not sound may be assimp's.
void mustBeSound(const Expected<PlainScene>& scene) {
    if (!scene) return must(!scene.error().message.empty(), "a refusal has words");
    for (const proto::scene::Mesh& mesh : scene->file.mesh()) {
        const auto sizeOf = [&](std::uint32_t blob) { return blob == 0 ? 0 : scene->blobs.at(blob - 1).size(); };
        const std::size_t vertices = sizeOf(mesh.positions_blob()) / 12;
        must(vertices > 0, "a mesh has vertices");
        for (const auto& [blob, bytes] :
             {std::pair(mesh.normals_blob(), 12u), {mesh.texcoords_blob(), 8u}, {mesh.colors_blob(), 4u}})
            must(sizeOf(blob) == 0 || sizeOf(blob) == bytes * vertices, "each vertex has as much as the others");
        if (mesh.indices_blob() == 0) continue;
        const Bytes& indices = scene->blobs.at(mesh.indices_blob() - 1);
        for (std::size_t at = 0; at < indices.size(); at += 4) {
            std::uint32_t index = 0;
            std::memcpy(&index, indices.data() + at, sizeof(index));
            must(index < vertices, "indices name vertices");
        }
    }
}

void run(FuzzInput in) {
    constexpr const char* kExtensions[] = {"gltf", "glb", "tsct", "tsc", "obj", "off", "ply", "stl", "png"};
    const std::string extension = kExtensions[in.below(9)];
    const ByteSpan bytes = in.rest();
    if (extension == "png") {
        const Expected<DecodedImage> image = decodeImage(bytes, 64);
        if (!image) return must(!image.error().message.empty(), "a refusal has words");
        const int slices = image->shape == proto::scene::Image::CUBE ? 6 : image->depthPx;
        must(image->compressed() || (image->rgba.size() == std::size_t{4} * static_cast<std::size_t>(image->widthPx) *
                                                               static_cast<std::size_t>(image->heightPx) *
                                                               static_cast<std::size_t>(slices) &&
                                     image->widthPx <= 64),
             "an image has the size that it says");
        return;
    }
    const ScratchFile file(extension.c_str(), bytes);
    ReadLimits limits;
    limits.maxFileBytes = 1 << 20;
    limits.maxNodes = 1000;
    limits.maxImageSide = 64;
    const bool isMesh = extension == "obj" || extension == "off" || extension == "ply" || extension == "stl";
    const Expected<PlainScene> scene =
        isMesh ? readTextMesh(file.path(), extension, limits) : readScene(file.path(), limits);
    if (extension == "obj") mustBeSound(readObj(file.path(), limits));
    if (extension == "ply") mustBeSound(readPly(file.path(), limits));
    if (extension == "stl") mustBeSound(readStl(file.path(), limits));
    if (!scene) must(!scene.error().message.empty(), "a refusal has words");
}

}  // namespace
}  // namespace tessera::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    tessera::fuzz::run({data, size});
    return 0;
}
