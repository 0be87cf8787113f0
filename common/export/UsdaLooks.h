/// Materials as USD has them: UsdPreviewSurface, with its pictures beside the file.
#pragma once

#include <map>
#include <string>

#include "common/cores/Image.h"
#include "common/cores/Material.h"
#include "common/export/Companions.h"
#include "common/export/Formats.h"

namespace tessera {

class UsdaLooks {
public:
    /// `scope`: the path of the prim that they are below.
    UsdaLooks(const LeavingScene& leaving, std::string scope) : leaving_(leaving), scope_(std::move(scope)) {}

    /// The path of a material, or of what is drawn without one. `node`: for notes.
    std::string path(ObjectId material, ObjectId node, Companions& companions, LeavingFiles& files);
    /// Of all, two levels deep.
    [[nodiscard]] const std::string& text() const { return text_; }

private:
    /// Shaders of one material, as they become.
    struct Shaders;
    void addInputs(const Material& material, Shaders& shaders);
    void addInput(Shaders& shaders, std::string_view type, std::string_view name, ObjectId image,
                  std::string_view channel, const std::string& value, const std::string& scale,
                  const std::string& bias = {});
    bool addTexture(Shaders& shaders, std::string_view name, std::string_view channel, ObjectId image,
                    const std::string& scale, const std::string& bias);
    /// The name of its file; empty: it cannot be written.
    std::string picture(const Image& image, Shaders& shaders);

    const LeavingScene& leaving_;
    std::string scope_, text_;
    std::map<ObjectId, std::string> known_;
    std::map<BlobId, std::string> pictures_;
};

}  // namespace tessera
