/// Materials and pictures of a scene of Coin.
#pragma once

#include <Inventor/nodes/SoNode.h>

#include <map>
#include <string>

#include "server/import/coin/CoinFiles.h"
#include "server/import/coin/CoinLook.h"
#include "server/import/coin/CoinMotion.h"
#include "server/import/reader/Pictures.h"
#include "server/import/reader/PlainScene.h"

class SoSFImage;

namespace tessera {

class CoinMaterials {
public:
    CoinMaterials(const CoinFiles& files, const ReadLimits& limits, CoinMotion& motion, PlainScene& scene)
        : files_(files), limits_(limits), motion_(motion), scene_(scene), pictures_(scene, limits) {}

    struct Wanted {
        CoinLook look;
        bool colored = false;             ///< corners have colours; the material's own is white
        bool strokes = false;             ///< lines or points, which nothing lights
        bool vrml2 = false;               ///< as that says it, else as Inventor does
        const SoNode* texture = nullptr;  ///< SoTexture2, SoVRMLImageTexture, SoVRMLPixelTexture
        const SoNode* source = nullptr;   ///< the node that says it, for its name; what moves has one of its own
        bool moves = false;
        std::string from;  ///< the file in which the texture's is named
    };
    /// The name of the material that looks so; made the first time.
    std::string name(const Wanted& wanted);
    /// Whether there is a picture to show; a note says why not.
    bool hasPicture(const SoNode& texture, const std::string& from) { return !picture(texture, from).image.empty(); }
    /// Whether that picture stands in the place of all colours, as those of colours do in VRML 2.
    bool replacesColors(const SoNode& texture, const std::string& from) { return picture(texture, from).replaces; }
    /// Once all are there.
    void finish() { pictures_.finish(); }

private:
    struct Shown {
        std::string image;  ///< empty: none
        bool translucent = false;
        bool replaces = false;  ///< the colour of what it lies on
    };
    const Shown& picture(const SoNode& texture, const std::string& from);
    Shown makePicture(const SoNode& texture, const std::string& from);
    Expected<DecodedImage> decodeFile(const std::vector<std::string>& names, const std::string& from, std::string& key,
                                      bool& isGrey);

    const CoinFiles& files_;
    const ReadLimits& limits_;
    CoinMotion& motion_;
    PlainScene& scene_;
    Pictures pictures_;
    std::map<const SoNode*, Shown> shown_;
    std::map<std::string, std::string> materials_;  ///< names, by what they are
    std::size_t images_ = 0;
};

}  // namespace tessera
