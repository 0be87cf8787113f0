/// USD: text, crates and packages, with themselves as the only file beside them.
#include <string>

#include "server/import/reader/UsdReader.h"
#include "tests/fuzz/FuzzInput.h"

namespace tessera::fuzz {
namespace {

void run(FuzzInput in) {
    const ByteSpan bytes = in.rest();
    UsdRemarks remarks;
    UsdFiles files(
        [&](const std::string& name) -> Expected<Bytes> {
            if (name != "x.usd") return fail(ErrorCode::kNotFound, name + ": there is no such file");
            return Bytes(bytes.begin(), bytes.end());
        },
        {.maxDepth = 50, .maxSpecs = 10'000});
    ReadLimits limits;
    limits.maxNodes = 10'000;
    limits.maxDepth = 50;
    limits.maxImageSide = 64;
    UsdStage stage(files, remarks);
    if (const Expected<void> opened = stage.open("x.usd"); !opened)
        return must(!opened.error().message.empty(), "a refusal has words");
    const Expected<PlainScene> scene = UsdReader(stage, files, remarks, limits).read();
    if (!scene) return must(!scene.error().message.empty(), "a refusal has words");
    for (const proto::scene::Mesh& mesh : scene->file.mesh())
        must(mesh.positions_blob() <= scene->blobs.size() && mesh.indices_blob() <= scene->blobs.size(),
             "arrays are there");
    must(scene->notes.size() < 300, "remarks are few, whatever the file is");
}

}  // namespace
}  // namespace tessera::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    tessera::fuzz::run({data, size});
    return 0;
}
