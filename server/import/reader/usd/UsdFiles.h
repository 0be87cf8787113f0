/// The layers and pictures of a scene: each file is read once, whether it lies in a folder or in a package (.usdz).
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>

#include "common/base/Bytes.h"
#include "common/base/Error.h"
#include "server/import/reader/usd/UsdLayer.h"
#include "server/import/reader/usd/UsdPackage.h"

namespace tessera {

class UsdFiles {
public:
    /// A file of the scene's own folder by its name relative to that. Errors name it.
    using Read = std::function<Expected<Bytes>(const std::string& name)>;
    /// More layers are refused: whoever names them makes work, not a scene.
    static constexpr std::size_t kMostLayers = 4096;

    UsdFiles(Read read, const UsdLayerLimits& limits) : read_(std::move(read)), limits_(limits) {}

    /// The layer that `asset` names in one of this identifier, by what is in it: text, crate, or a package's first.
    /// Identifiers are "folder/name.usda", or "name.usdz[inside.usdc]".
    [[nodiscard]] Expected<std::shared_ptr<const UsdLayer>> layer(const std::string& asset, const std::string& by);
    /// A picture, or any other file.
    [[nodiscard]] Expected<Bytes> bytes(const std::string& asset, const std::string& by);
    /// Of all layers so far.
    [[nodiscard]] std::size_t bytesRead() const { return bytesRead_; }

    /// The identifier of what `asset` names; "" where that leads out of the folder.
    [[nodiscard]] static std::string identifierOf(const std::string& asset, const std::string& by);

private:
    Expected<std::shared_ptr<const UsdLayer>> parse(const std::string& identifier, ByteSpan bytes);
    Expected<std::shared_ptr<const UsdPackage>> package(const std::string& name);

    Read read_;
    UsdLayerLimits limits_;
    std::map<std::string, Expected<std::shared_ptr<const UsdLayer>>> layers_;
    std::map<std::string, Expected<std::shared_ptr<const UsdPackage>>> packages_;
    std::size_t bytesRead_ = 0;
};

}  // namespace tessera
