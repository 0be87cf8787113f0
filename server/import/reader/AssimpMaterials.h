/// Materials and textures that assimp read.
#pragma once

#include <assimp/material.h>
#include <assimp/scene.h>

#include <map>
#include <optional>
#include <set>
#include <string>

#include "server/import/reader/FolderFiles.h"
#include "server/import/reader/Pictures.h"
#include "server/import/reader/PlainScene.h"

namespace tessera {

class AssimpMaterials {
public:
    /// `sidesUnknown`: the format does not say whether a face has a back.
    AssimpMaterials(const aiScene& source, const FolderFiles& files, const ReadLimits& limits, bool sidesUnknown,
                    PlainScene& scene)
        : source_(source),
          files_(files),
          limits_(limits),
          sidesUnknown_(sidesUnknown),
          scene_(scene),
          pictures_(scene, limits) {}

    /// Adds the material the first time. Empty where there is none of this number.
    std::string name(unsigned index);
    /// Once all are there.
    void finish() { pictures_.finish(); }

private:
    void setColors(const aiMaterial& material, proto::scene::Material& message);
    void setTextures(const aiMaterial& material, proto::scene::Material& message);
    void setMetalRoughness(const aiMaterial& material, proto::scene::Material& message, std::set<aiTextureType>& taken);
    /// Names each kind of texture that is none of these.
    void noteOthers(const aiMaterial& material, const std::set<aiTextureType>& taken);
    /// The Image of the first of these kinds that the material has; empty with a note where it can't be had.
    std::string image(const aiMaterial& material, std::initializer_list<aiTextureType> kinds,
                      std::set<aiTextureType>& taken);
    /// The Image that shows a picture so; empty with a note where it can't be had.
    std::string imageOf(const std::string& picture, const proto::scene::Image& wanted,
                        const std::function<Expected<DecodedImage>()>& decode);
    /// How the texture is taken; nothing, with a note, where that cannot be shown.
    std::optional<proto::scene::Image> look(const aiMaterial& material, aiTextureType kind);
    Expected<DecodedImage> decode(const std::string& file);
    /// Metal and roughness as glTF packs them; either may be missing.
    Expected<DecodedImage> decodePacked(const std::string& metal, const std::string& roughness);

    const aiScene& source_;
    const FolderFiles& files_;
    const ReadLimits& limits_;
    bool sidesUnknown_;
    PlainScene& scene_;
    Pictures pictures_;
    std::set<unsigned> materials_;
    std::map<std::pair<std::string, std::string>, std::string>
        images_;  ///< by picture, and what the message says besides
};

}  // namespace tessera
