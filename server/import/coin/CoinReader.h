/// VRML 1.0 and 2.0, X3D and Inventor, by Coin. Runs in the confined child tessera-import-coin.
#pragma once

#include <set>
#include <string>

#include "common/base/Error.h"
#include "server/import/reader/PlainScene.h"

namespace tessera {

/// Before the process is confined.
void prepareCoin();
/// Of all files that are read: ".iv", ".wrl", ….
[[nodiscard]] std::set<std::string> coinEndings();
/// `path`: absolute, without symbolic links.
[[nodiscard]] Expected<PlainScene> readWithCoin(const std::string& path, const ReadLimits& limits);

}  // namespace tessera
