#include "server/import/coin/CoinReader.h"

#include "server/import/coin/CoinFiles.h"
#include "server/import/coin/CoinWalk.h"

namespace tessera {

void prepareCoin() {
    CoinFiles::prepare();
}

std::set<std::string> coinEndings() {
    return {".iv", ".vrml", ".wrl", ".wrz", ".x3d", ".x3db", ".x3dv"};
}

Expected<PlainScene> readWithCoin(const std::string& path, const ReadLimits& limits) {
    PlainScene scene;
    // Never deleted, as the process ends soon: Coin's destructors recurse as deep as a file is nested.
    CoinFiles& files = *new CoinFiles(path, limits, scene);
    const Expected<SoSeparator*> root = files.open(path);
    if (!root) return tl::unexpected(root.error());
    CoinWalk& walk = *new CoinWalk(path, files.textBytes(), limits, files, scene);
    if (const Expected<void> done = walk.walk(**root); !done) return tl::unexpected(done.error());
    if (scene.file.node().empty() && !scene.notes.empty())
        return fail(ErrorCode::kBadInput,
                    "there is nothing in it to show: " + (scene.missing.empty() ? scene.notes : scene.missing).front());
    constexpr std::uint32_t kY = 2;
    scene.file.set_up_axis(kY);
    return scene;
}

}  // namespace tessera
