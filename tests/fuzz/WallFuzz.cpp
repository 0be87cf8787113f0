/// The text of a wall, and a wall as it travels: what is read can be laid out, seen and written again.
#include "common/codec/WallCodec.h"
#include "common/wall/View.h"
#include "tests/fuzz/FuzzInput.h"

namespace tessera::fuzz {
namespace {

void run(FuzzInput in) {
    const bool text = in.below(2) == 0;
    const ByteSpan bytes = in.rest();
    const Expected<Wall> wall =
        text ? parseWall({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, "fuzz.wall") : decodeWall(bytes);
    if (!wall) return must(!wall.error().message.empty(), "a refusal has words");
    const Bytes written = encodeWall(*wall);
    const Expected<Wall> again = decodeWall(written);
    must(again.has_value() && encodeWall(*again) == written, "a wall that is read can be written and read again");
    View view;
    view.users = wall->users;
    for (const Tile& tile : layoutTiles(*wall)) {
        const ScreenCamera camera = tileCamera(*wall, tile, view);
        must(camera.clip_T_eye.allFinite() && camera.eye_T_world.matrix().allFinite(),
             "each tile of a wall has a camera");
    }
}

}  // namespace
}  // namespace tessera::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    tessera::fuzz::run({data, size});
    return 0;
}
