/// What our own code reads in the confined child: glTF, Tessera's scenes, text meshes, images. (What assimp reads is
/// assimp's, which is why there is a child.)
#include <string>

#include "server/import/reader/ImageDecoder.h"
#include "server/import/reader/ReadScene.h"
#include "tests/fuzz/FuzzInput.h"
#include "tests/fuzz/ScratchFile.h"

namespace tessera::fuzz {
namespace {

void run(FuzzInput in) {
    constexpr const char* kExtensions[] = {"gltf", "glb", "tsct", "tsc", "obj", "off", "ply", "stl", "png"};
    const std::string extension = kExtensions[in.below(9)];
    const ByteSpan bytes = in.rest();
    if (extension == "png") {
        if (const Expected<DecodedImage> image = decodeImage(bytes, 64))
            must(image->rgba.size() == static_cast<std::size_t>(4 * image->widthPx * image->heightPx) &&
                     image->widthPx <= 64,
                 "an image has the size that it says");
        return;
    }
    const ScratchFile file(extension.c_str(), bytes);
    ReadLimits limits;
    limits.maxFileBytes = 1 << 20;
    limits.maxNodes = 1000;
    limits.maxImageSide = 64;
    const bool text = extension != "gltf" && extension != "glb" && extension != "tsct" && extension != "tsc";
    const Expected<PlainScene> scene =
        text ? readTextMesh(file.path(), extension, limits) : readScene(file.path(), limits);
    if (!scene) must(!scene.error().message.empty(), "a refusal has words");
}

}  // namespace
}  // namespace tessera::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    tessera::fuzz::run({data, size});
    return 0;
}
