/// Descriptions of walls for other programs, in each format that is read.
#include "common/codec/WallCodec.h"
#include "server/tools/WallFormats.h"
#include "tests/fuzz/FuzzInput.h"
#include "tests/fuzz/ScratchFile.h"

namespace tessera::fuzz {
namespace {

void run(FuzzInput in) {
    const WallFormat& format = wallFormats()[in.below(wallFormats().size())];
    const ByteSpan bytes = in.rest();
    // Archives are opened by their path.
    const ScratchFile file(format.ending.data() + 1, bytes);
    const Expected<ForeignWall> made = format.read(file.path(), asText(bytes));
    if (!made) return must(!made.error().message.empty(), "a refusal has words");
    must(checkWall(made->wall).has_value(), "a wall that is made can be used");
    const Expected<Wall> again = decodeWall(encodeWall(made->wall));
    must(again.has_value() && again->screens.size() == made->wall.screens.size(), "it can be written and read again");
}

}  // namespace
}  // namespace tessera::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    tessera::fuzz::run({data, size});
    return 0;
}
